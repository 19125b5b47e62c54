"""A newcomer's way to a calibrated sensor: questions, practice, a spoilt placement, its repair."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.terminal import Terminal, at_terminal, plain_lines
from workbench.model import event as ev
from workbench.model.calibration import load_calibration
from workbench.model.fit_event import FitFinished
from workbench.model.rig import load_rig
from workbench.session.journal import read_journal
from workbench.session.state import effective

pytestmark = pytest.mark.thorough
ANSWERS = {
    "Name of the sensor?": ["three"],
    "Serial number of the sensor?": ["LS-0042"],
    "Camera?": [""],
    "Size of its images": ["1280", "1280 x 720"],  # a wrong answer is asked again
    "Pixel pitch": ["3"],
    "Focal length": ["0.4 mm", "4 mm"],
    "f-number": ["back", "4 mm", "f/2"],  # the previous question again
    "Wavelength": ["650"],
    "Distances of the laser beams": ["-60 0 60", "-60 30 60"],
    "measured?": ["calliper"],
    "Class of the lasers": ["", "2"],
    "Serial port": [""],
    "to practise?": ["yes"],
}
SHORTER = {  # of the procedure, for the time of the test
    "[125, 160, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500]": "[160, 280, 600, 1400, 2800, 4500]",
    "returns: 2": "returns: 0",
    "repeats: 10": "repeats: 2",
}
STANDOFFS = 6
SPOILT = "calibrate-flat.2/600mm"
WIDTH = 80


def answer_all(terminal: Terminal) -> None:
    for question, answers in ANSWERS.items():
        terminal.wait_for(question)
        for answer in answers:
            terminal.type(answer)


def assert_fits(terminal: Terminal) -> None:
    """Nothing is wider than the terminal, except paths, which must not be broken."""
    assert "Traceback" not in terminal.text
    for line in plain_lines(terminal.text):
        assert len(line) <= WIDTH or "sessions/" in line, line


def edit(path: Path, changes: dict[str, str]) -> None:
    text = path.read_text()
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text)


def test_a_newcomer_calibrates_a_new_sensor_and_repairs_a_spoilt_placement(tmp_path: Path) -> None:
    with at_terminal(tmp_path, "new", "lab", columns=WIDTH) as terminal:
        answer_all(terminal)
        assert terminal.end() == 0, terminal.text
        assert_fits(terminal)
    lab = tmp_path / "lab"
    real, practice = (load_rig(lab / f"rigs/{name}.yaml") for name in ("three", "three-practice"))
    for rig in (real, practice):
        assert [laser.x_mm.value for laser in rig.lasers] == [-60.0, 30.0, 60.0]
        assert rig.serial.startswith("LS-0042")
        assert (rig.camera.width_px, rig.camera.height_px, rig.laser_class) == (1280, 720, "2")
    # The printed commands, with a spoilt placement as the practice rig file offers it.
    commands = [line for line in plain_lines(terminal.text) if line.startswith("workbench run ")]
    command = next(line for line in commands if "practice" in line)
    edit(lab / "rigs/three-practice.yaml", {"# truth:": "truth:"})
    edit(lab / "procedures/calibrate-flat.yaml", SHORTER)

    with at_terminal(lab, *command.split()[1:], "--no-view", columns=WIDTH) as terminal:
        terminal.wait_for("class 2")
        terminal.type("yes")
        for _ in range(STANDOFFS):
            terminal.wait_for("Place the target at")
            terminal.type("")
        terminal.wait_for("REFUSED")
        terminal.wait_for("or redo (")
        terminal.type("redo")
        terminal.type("the target had slipped")
        terminal.type("yes")
        terminal.wait_for("Place the target at 600 mm")
        terminal.type("")
        assert terminal.end() == 0, terminal.text
        assert_fits(terminal)
    end = plain_lines(terminal.text)
    verdict = next(n for n, line in enumerate(end) if line.startswith("ACCEPTED"))
    assert len(end) - verdict <= 24, "one screen"

    (session,) = (path.parent for path in (lab / "sessions").glob("*/session.yaml"))
    records = list(read_journal(session))
    fits = [record.event for record in records if isinstance(record.event, FitFinished)]
    assert [fit.verdict for fit in fits] == ["refused", "accepted"]
    assert [fault.placement for fault in fits[0].faults] == [SPOILT]
    repairs = [e for e in (r.event for r in effective(records)) if isinstance(e, ev.SessionRepaired)]
    assert [(one.recapture, one.reason) for one in repairs] == [((SPOILT,), "the target had slipped")]
    assert load_calibration(session / "calibration.yaml").laser_ranger.fit.verdict == "accepted"
