"""`workbench report`: files, numbers, JSON, and messages for wrong input."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec

from tests.support.command_line import Run, refused
from tests.support.laboratory_key import write_key
from tests.support.pango import need_pango
from tests.support.reference_session import MARKUP, REFERENCE, copied, edit_calibration
from workbench.session.certificate_numbers import REGISTER
from workbench.session.journal import JOURNAL

DATA = REFERENCE.parents[1]
LAB = f"""\
format: 1
laboratory: {{name: Example laboratory}}
country: DE
customer: {{name: "{MARKUP}"}}
authorised_by: A. Example
"""


def test_certificate_in_every_format(workbench: Run, tmp_path: Path) -> None:
    need_pango()
    session = copied(tmp_path)
    (tmp_path / "lab.yaml").write_text(LAB)
    files = [tmp_path / f"out.{ending}" for ending in ("html", "pdf", "xml")]
    options = ["-o", files[0], "--pdf", files[1], "--dcc", files[2], "--json"]
    done = workbench("report", session, *options)
    assert done.code == 0
    found = json.loads(done.out)
    assert found["number"].endswith("-0001")
    assert found["head"]["Customer"] == MARKUP
    assert MARKUP not in files[0].read_text()
    assert files[1].read_bytes().startswith(b"%PDF")
    assert f"{found['number']}<" in files[2].read_text()


def test_a_digital_certificate_is_signed(workbench: Run, tmp_path: Path) -> None:
    pytest.importorskip("signxml", reason="the optional extra `sign` is not installed")
    session, file = copied(tmp_path), tmp_path / "out.xml"
    (tmp_path / "lab.yaml").write_text(LAB)
    key = ec.generate_private_key(ec.SECP256R1())
    pem, cert = write_key(tmp_path, key)
    refused(workbench("report", session, "--sign", pem, "--cert", cert), 2, "--dcc")
    refused(workbench("report", session, "--dcc", file, "--sign", pem), 2, "--cert")
    refused(workbench("report", session, "--dcc", file, "--sign", cert, "--cert", cert), 2, cert)
    assert not (tmp_path / REGISTER).exists()
    assert workbench("report", session, "--dcc", file, "--sign", pem, "--cert", cert).code == 0
    assert "X509Certificate>" in file.read_text()


def test_the_same_session_keeps_its_number_and_its_content(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    first, second = (workbench("report", session, "--json").out for _ in range(2))
    assert first == second
    assert len((tmp_path / REGISTER).read_text().splitlines()) == 1
    (tmp_path / "lab.yaml").write_text(LAB)
    third = json.loads(workbench("report", session, "--json").out)
    assert third["replaces"] == json.loads(first)["number"]


def test_the_page_is_in_the_session_by_default(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    done = workbench("report", session.name, "--sessions", tmp_path)
    assert done.code == 0
    assert (session / "certificate.html").exists()
    assert "not stated" in done.err, "there is no lab.yaml, and nothing is invented"
    assert not (tmp_path / "lab.yaml").exists()


def test_a_recalibration_states_the_sensor_as_found(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path, "20251130-080000-reference")
    old = tmp_path / "20251130-080000-reference/session.yaml"
    old.write_text(old.read_text().replace("2026-11-30T", "2025-11-30T"))
    found = json.loads(workbench("report", copied(tmp_path), "--json").out)
    change = next(section for section in found["sections"] if section["key"] == "change")
    assert "20251130-080000-reference/calibration.yaml" in change["texts"][0]


def test_two_sessions_are_compared(workbench: Run, tmp_path: Path) -> None:
    a, b = copied(tmp_path, "a"), copied(tmp_path, "b")
    page = tmp_path / "page.html"
    done = workbench("report", "--compare", a, b, "-o", page, "--json")
    assert done.code == 0
    assert json.loads(done.out)["verdict"]["tone"] == "good"
    assert page.exists()
    assert not (tmp_path / REGISTER).exists()
    refused(workbench("report", "--compare", a, b, "--dcc", page), 2, "--dcc")


@pytest.mark.parametrize("name", ["session-0.1.0", "simulation-0.1.0"])
def test_old_sessions_and_sessions_without_calibration(workbench: Run, tmp_path: Path, name: str) -> None:
    session = tmp_path / name
    shutil.copytree(DATA / name, session, ignore=shutil.ignore_patterns("frames"))
    assert workbench("report", session).code == 0


@pytest.mark.parametrize("file", [JOURNAL, "session.yaml", "calibration.yaml"])
def test_a_damaged_session_is_named(workbench: Run, tmp_path: Path, file: str) -> None:
    session = copied(tmp_path)
    (session / file).write_text("damaged: [")
    if file == JOURNAL:
        (session / file).write_text("damaged\n")
    refused(workbench("report", session), 2, file)
    assert not (tmp_path / REGISTER).exists()


def test_an_edited_calibration_gets_no_certificate(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    edit_calibration(session)
    refused(workbench("report", session), 2, "calibration.yaml", "workbench fit")
    assert not (tmp_path / REGISTER).exists()


def test_a_changed_frame_gets_no_certificate(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path, frames=True)
    frame = next(session.glob("frames/reference.6/**/*-on.png"))
    frame.write_bytes(frame.read_bytes() + b"changed")
    refused(workbench("report", session), 2, frame.name)
    assert not (tmp_path / REGISTER).exists()


def test_the_certificate_counts_missing_frames(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path, frames=True)
    for frame in session.glob("frames/reference.6/500mm/00/*.png"):
        frame.unlink()
    done = json.loads(workbench("report", session, "--json").out)
    (data,) = [one for one in done["sections"] if one["key"] == "data"]
    frames = data["facts"]["Frames"]
    assert frames.split()[0] == "2"


@pytest.mark.parametrize("option", ["-o", "--pdf", "--dcc"])
def test_a_file_of_the_record_is_not_replaced(workbench: Run, tmp_path: Path, option: str) -> None:
    session = copied(tmp_path)
    (tmp_path / "lab.yaml").write_text(LAB)
    for name in (JOURNAL, "session.yaml", "calibration.yaml"):
        before = (session / name).read_bytes()
        refused(workbench("report", session, option, session / name), 2, name)
        assert (session / name).read_bytes() == before


def test_a_session_that_has_only_begun(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    done = workbench("report", session, "--json")
    assert done.code == 0
    assert json.loads(done.out)["verdict"]["tone"] == "open"


def test_an_empty_session_gets_no_digital_certificate_and_no_number(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    (tmp_path / "lab.yaml").write_text(LAB)
    refused(workbench("report", session, "--dcc", tmp_path / "x.xml"), 2, session.name)
    assert not (tmp_path / REGISTER).exists()


def test_outputs_that_cannot_be_written_are_named_before_a_number_is_assigned(
    workbench: Run, tmp_path: Path
) -> None:
    session = copied(tmp_path)
    for option in ("-o", "--pdf", "--dcc"):
        missing = tmp_path / "missing/file"
        refused(workbench("report", session, option, missing), 2, missing)
        refused(workbench("report", session, option, tmp_path), 2, tmp_path)
    assert not (tmp_path / REGISTER).exists()


def test_wrong_arguments(workbench: Run, tmp_path: Path) -> None:
    assert workbench("report").code == 2
    assert workbench("report", "a", "--compare", "b", "c").code == 2
    refused(workbench("report", tmp_path / "missing"), 2, "missing")
    session = copied(tmp_path)
    refused(workbench("report", session, "--dcc", tmp_path / "x.xml"), 2, "country", "laboratory")
    (tmp_path / "lab.yaml").write_text("format: 1\ncountry: Germany\n")
    refused(workbench("report", session), 2, "lab.yaml:2")
