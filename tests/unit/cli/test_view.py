"""`workbench view`: what is shown for a session, two of them, a captures file, a calibration, a recording."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from tests.viewer.readback import Contents
from workbench.cli.view import Request, recording_of
from workbench.model.errors import BadInputError
from workbench.session.journal import Journal
from workbench.viewer.window import is_complete

ROOT = Path(__file__).parents[3]
SESSION = ROOT / "data/session-0.1.0"
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "sessions" / "one"
    shutil.copytree(SESSION, folder)
    return folder


def asked(*what: Path, rebuild: bool = False) -> Request:
    return Request(what, Path("sessions"), None, rebuild=rebuild)


def test_a_folder_without_a_session_is_refused(workbench: Run, tmp_path: Path) -> None:
    refused(workbench("view", tmp_path), 2, "expected a session folder")
    assert list(tmp_path.iterdir()) == []


def test_a_session_is_found_by_its_name(session: Path, tmp_path: Path) -> None:
    request = Request((Path("one"),), session.parent, None)
    assert recording_of(request, tmp_path) == session / "recording.rrd"
    assert (session / "recording.rrd").is_file()


@pytest.mark.long_cases
@pytest.mark.parametrize("kept", [0.0, 0.5, 1.0])
def test_an_incomplete_recording_is_made_again_and_a_complete_one_is_kept(
    session: Path, tmp_path: Path, kept: float
) -> None:
    recording = recording_of(asked(session), tmp_path)
    whole = recording.read_bytes()
    recording.write_bytes(whole[: round(kept * len(whole))])
    written = recording.stat().st_mtime_ns
    again = recording_of(asked(session), tmp_path)
    assert (again.stat().st_mtime_ns == written) == (kept == 1.0)
    assert again.read_bytes()[-64:].count(b"RRF2FOOT") == 1


def test_the_recording_that_a_running_session_writes_is_left_alone(session: Path, tmp_path: Path) -> None:
    (session / "recording.rrd").write_bytes(b"incomplete")
    journal, _ = Journal.reopen(session)
    with journal:
        shown = recording_of(asked(session), tmp_path)
    assert shown == tmp_path / "recording.rrd"
    assert is_complete(shown)
    assert (session / "recording.rrd").read_bytes() == b"incomplete"


def test_a_rebuilt_recording_has_the_same_content(session: Path, tmp_path: Path) -> None:
    first = Contents(recording_of(asked(session), tmp_path)).everything()
    again = Contents(recording_of(asked(session, rebuild=True), tmp_path)).everything()
    assert again == first


def test_two_sessions_have_all_entities_twice(session: Path, tmp_path: Path) -> None:
    alone = Contents(recording_of(asked(session), tmp_path)).entities
    both = Contents(recording_of(asked(session, session), tmp_path)).entities
    mine = {entity for entity in alone if not entity.startswith("/__")}
    assert {f"/a{entity}" for entity in mine} | {f"/b{entity}" for entity in mine} <= both


def test_a_captures_file_is_fitted_and_shown(tmp_path: Path) -> None:
    request = Request((WEBCAM,), Path("sessions"), WEBCAM_RIG)
    contents = Contents(recording_of(request, tmp_path))
    assert {"/fit/picture/v/image", "/fit/verdict", "/fit/worst"} <= contents.entities
    assert len(contents.values("/capture/record", "nominal_mm")) == 9


def test_a_captures_file_needs_its_rig_file(workbench: Run) -> None:
    refused(workbench("view", WEBCAM), 2, "--rig")


def test_a_calibration_shows_its_uncertainty_and_parameters(tmp_path: Path) -> None:
    contents = Contents(recording_of(asked(SESSION / "calibration.yaml"), tmp_path))
    assert {"/calibration/uncertainty/image", "/calibration/parameters"} <= contents.entities


def test_a_refit_stands_beside_its_captures_file(tmp_path: Path) -> None:
    request = Request((WEBCAM,), Path("sessions"), WEBCAM_RIG, without_mm=(300.0,))
    contents = Contents(recording_of(request, tmp_path))
    counts = [len(contents.values(f"/{side}/capture/record", "nominal_mm")) for side in "ab"]
    assert counts[0] > counts[1] > 0


@pytest.mark.parametrize(
    ("what", "without", "word"),
    [((SESSION,) * 3, (), "one or two"), ((SESSION, SESSION), (300.0,), "--without-standoff")],
)
def test_more_than_fits_on_a_screen_is_refused(
    tmp_path: Path, what: tuple[Path, ...], without: tuple[float, ...], word: str
) -> None:
    with pytest.raises(BadInputError, match=word):
        recording_of(Request(what, Path("sessions"), None, without), tmp_path)


@pytest.mark.parametrize(
    "what", [(Path("any.rrd"),), (WEBCAM,), (SESSION / "calibration.yaml",), (SESSION, SESSION)]
)
def test_only_the_recording_of_one_session_can_be_made_again(tmp_path: Path, what: tuple[Path, ...]) -> None:
    with pytest.raises(BadInputError, match="--rebuild"):
        recording_of(asked(*what, rebuild=True), tmp_path)


def test_a_recording_is_shown_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "any.rrd"
    assert recording_of(asked(path), tmp_path) == path


def test_without_a_display_a_rebuilt_recording_is_named_and_others_need_a_browser(
    session: Path, tmp_path: Path, workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    made = workbench("view", session, "--rebuild")
    assert (made.code, made.out) == (0, "")
    assert str(session / "recording.rrd") in "".join(made.err.split())
    shown = workbench("view", WEBCAM, "--rig", WEBCAM_RIG)
    refused(shown, 2, "--web")
    assert ".rrd" not in shown.err, "a recording in a folder that is gone"


@pytest.mark.parametrize("what", [WEBCAM_RIG, SESSION / "journal.jsonl", ROOT / "README.md"])
def test_a_file_that_cannot_be_shown_is_refused(tmp_path: Path, what: Path) -> None:
    with pytest.raises(BadInputError, match=what.name):
        recording_of(asked(what), tmp_path)
