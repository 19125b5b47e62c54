"""`session.yaml`: everything that a session started from."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.support.procedures import RIG, plan_of
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.session.manifest import (
    MANIFEST,
    RECORDED_VERSIONS,
    CalibrationEntry,
    create_session,
    load_manifest,
    load_session_rig,
    recorded_versions,
    replace_manifest,
    workbench_version,
)

ODD = "# with: a colon, 'quotes' and a tab\t\n# and an umlaut: ä\n"


@pytest.fixture
def session(tmp_path: Path) -> Path:
    rig = tmp_path / "rig.yaml"
    rig.write_text(ODD + RIG.read_text(), encoding="utf-8")
    plan = plan_of(tmp_path, rig, a="  - {step: message, text: Hello.}\n")
    paths = plan.procedure_paths
    create_session(tmp_path / "s", plan.rig, rig, paths, operator="A. T", created="now", command="run 'a b'")
    return tmp_path / "s"


def test_files_are_kept_word_for_word(session: Path) -> None:
    manifest = load_manifest(session)
    assert manifest.rig.text == ODD + RIG.read_text()
    assert manifest.rig.file == str(session.parent / "rig.yaml")
    assert manifest.procedures[0].text == (session.parent / "a.yaml").read_text()
    assert (manifest.operator, manifest.created, manifest.command) == ("A. T", "now", "run 'a b'")
    assert load_session_rig(session) == load_rig(RIG)


def test_a_recorded_rig_beyond_the_bounds_of_today_is_read_but_not_computed_with(session: Path) -> None:
    manifest = session / MANIFEST
    text = manifest.read_text()
    beyond = {
        "value: 533.3, sd: 26.7": "value: 0.5, sd: 0.1",
        "value: 319.5, sd: 40.0": "value: 9e3, sd: 40.0",
    }
    for number, other in beyond.items():
        assert text.count(number) == 1
        text = text.replace(number, other)
    manifest.write_text(text)
    rig = load_session_rig(session)
    assert (rig.camera.f_px.value, rig.camera.cx_px.value) == (0.5, 9000.0)
    with pytest.raises(BadInputError, match="f_px"):
        load_session_rig(session, bounded=True)


def test_versions_are_those_of_the_installed_packages(session: Path) -> None:
    versions = load_manifest(session).versions
    assert versions == recorded_versions()
    assert versions["python"] == platform.python_version()
    assert all(versions[name] == version(name) for name in RECORDED_VERSIONS)
    assert workbench_version() == version("laser-range-workbench")


def test_an_existing_calibration_stays_in_a_replaced_manifest(tmp_path: Path) -> None:
    rig, entry = load_rig(RIG), CalibrationEntry(file="/lab/calibration.yaml", sha256="0" * 64)
    session = tmp_path / "s"
    create_session(session, rig, RIG, [], operator="", created="", command="", calibration=entry)
    first = load_manifest(session)
    assert first.calibration == entry
    replace_manifest(session, first, first.rig, first.procedures)
    assert load_manifest(session).calibration == entry


def test_a_session_never_takes_the_place_of_another(session: Path) -> None:
    before = (session / MANIFEST).read_bytes()
    with pytest.raises(BadInputError, match=str(session)) as caught:
        create_session(session, load_rig(RIG), RIG, [], operator="", created="", command="")
    assert caught.value.exit_code == 2
    assert (session / MANIFEST).read_bytes() == before


def test_a_manifest_that_is_replaced_stays_beside_the_new_one(session: Path) -> None:
    first = load_manifest(session)
    for text in ("other: 1\n", "another: 2\n"):
        rig = first.rig.model_copy(update={"text": text})
        replace_manifest(session, first, rig, first.procedures)
    assert load_manifest(session).rig.text == "another: 2\n"
    assert "other: 1" in (session / "session-2.yaml").read_text()
    assert (load_manifest(session).created, load_manifest(session).command) == (first.created, first.command)
    assert len(list(session.glob("session*.yaml"))) == 3


def test_a_manifest_of_before_the_command_was_kept_is_read(session: Path) -> None:
    path = session / MANIFEST
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if not line.startswith("command:")))
    assert load_manifest(session).command == ""


def test_a_folder_without_a_manifest_is_no_session(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(BadInputError, match=str(folder)):
            load_manifest(folder)
