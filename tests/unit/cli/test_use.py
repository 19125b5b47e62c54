"""`workbench use`: a calibration in force, with the change in mm; another sensor's is refused."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from tests.support.command_line import Run, refused
from tests.support.reference_session import REFERENCE, SERIAL, copied, edit_calibration, repair, repeated
from tests.support.verified_sensor import FIRST, write_verification
from workbench.session.journal import JOURNAL


def in_force(workbench: Run, sessions: Path) -> str:
    found = json.loads(workbench("history", "--sessions", sessions, "--rig", SERIAL, "--json").out)
    return str(found["head"]["Calibration in force"])


def test_roll_back_to_an_earlier_calibration(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path, "a")
    repeated(tmp_path, "b", days=1)
    assert in_force(workbench, tmp_path).startswith("b,")
    options = ["--rig", SERIAL, "--sessions", tmp_path]
    done = workbench("use", "a", "--reason", "the newer one is worse", *options)
    assert done.code == 0
    assert "at 500 mm: " in done.err
    assert "newer" in done.err
    assert in_force(workbench, tmp_path).startswith("a,")
    assert "the newer one is worse" in in_force(workbench, tmp_path)
    back = workbench("use", tmp_path / "b/calibration.yaml", "--reason", "repaired", *options)
    assert back.code == 0
    assert "newer" not in back.err
    assert in_force(workbench, tmp_path).startswith("b,")


def test_a_calibration_of_another_sensor_is_refused(workbench: Run, tmp_path: Path) -> None:
    other = REFERENCE.parents[1] / "session-0.1.0/calibration.yaml"
    done = workbench("use", other, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
    refused(done, 2, SERIAL)
    assert list(tmp_path.iterdir()) == []


def test_an_edited_calibration_of_a_session_is_refused(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    edit_calibration(session)
    for name in (session.name, session / "calibration.yaml"):
        done = workbench("use", name, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
        refused(done, 2, "calibration.yaml", "workbench fit")


def test_a_refused_calibration_is_not_put_in_force(workbench: Run, tmp_path: Path) -> None:
    path = Path(shutil.copy(REFERENCE / "calibration.yaml", tmp_path))
    path.write_text(path.read_text().replace('verdict: "accepted"', 'verdict: "refused"'))
    refused(workbench("use", path, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path), 3, "refused")


def test_a_refused_session_is_not_put_in_force(workbench: Run, tmp_path: Path) -> None:
    """The calibration from before the repair still lies in the folder."""
    session = copied(tmp_path)
    repair(session, "refused")
    for name in (session.name, session / "calibration.yaml"):
        done = workbench("use", name, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
        refused(done, 3, "too few standoffs")
    assert not (tmp_path / "sensors.jsonl").exists()


def test_a_reason_and_an_existing_calibration_are_needed(workbench: Run, tmp_path: Path) -> None:
    assert workbench("use", "a", "--rig", SERIAL).code == 2
    done = workbench("use", "a", "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
    refused(done, 2, "a")


def test_a_calibration_from_before_a_repair_is_not_put_in_force(workbench: Run, tmp_path: Path) -> None:
    """The repair begins the steps after the captures again; the old file still lies in the folder."""
    session = copied(tmp_path)
    last = json.loads((session / JOURNAL).read_text().splitlines()[-1])
    said = {"operator": "operator", "command": "workbench repair", "created": "2026-11-30T10:00:00+0000"}
    events = (
        {"kind": "session_repaired", "leave_out": ["reference.3/150mm"], "reason": "test", **said},
        {"kind": "session_resumed", "from_n": 97, **said},
    )
    with (session / JOURNAL).open("a") as file:
        for n, event in enumerate(events, start=1):
            record = {"n": last["n"] + n, "time_ns": last["time_ns"] + n, "event": event}
            file.write(json.dumps(record) + "\n")
    path = session / "calibration.yaml"
    done = workbench("use", path, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
    refused(done, 2, "calibration.yaml", "repaired")


def test_the_copy_of_a_verification_is_not_put_in_force(workbench: Run, tmp_path: Path) -> None:
    """The message names the calibration that the verification used."""
    made = copied(tmp_path)
    verification = write_verification(tmp_path, FIRST, [[0.001]] * 3)
    copy = Path(shutil.copy(made / "calibration.yaml", verification))
    for name in (verification.name, copy):
        done = workbench("use", name, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
        refused(done, 2, verification.name, "workbench use calibration.yaml", SERIAL)
    assert not (tmp_path / "sensors.jsonl").exists()
