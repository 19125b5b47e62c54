"""The reference session of this release is read, refitted, shown and exported as it was."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from tests.support.command_line import SCRIPT, shell
from tests.support.reference_session import REFERENCE, copied, record
from tests.viewer.readback import Contents
from workbench.model import event as ev
from workbench.model.calibration import load_calibration
from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective, session_status
from workbench.viewer.recording import rebuild

MOST_BYTES = 2_000_000


def test_it_is_finished_and_small() -> None:
    status = session_status(REFERENCE)
    assert (status.state, status.captures) == ("finished", 30)
    assert sum(path.stat().st_size for path in REFERENCE.rglob("*")) < MOST_BYTES


def test_its_captures_give_its_calibration_again(tmp_path: Path) -> None:
    session, again = copied(tmp_path, frames=True), tmp_path / "again.yaml"
    done = shell(f"{SCRIPT} fit {session} -o {again} --json")
    assert done.returncode == 0, done.stderr
    old, new = (load_calibration(path) for path in (REFERENCE / "calibration.yaml", again))
    sd = dict(zip(old.laser_ranger.parameters.names, old.laser_ranger.parameters.sd, strict=True))
    for name, value in old.geometry().items():
        # Another version may weigh spots differently: by a part of the deviation.
        assert abs(new.geometry()[name] - value) <= max(sd[name], 1e-12)


def test_its_recording_is_made_again(tmp_path: Path) -> None:
    session = copied(tmp_path, frames=True)
    rebuild(session, load_session_rig(session), effective(read_journal(session)), session / "recording.rrd")
    contents = Contents(session / "recording.rrd")
    assert {entity.split("/")[2] for entity in contents.entities if entity.startswith("/trials/")}


def test_its_certificate_is_written_by_the_installed_command(tmp_path: Path) -> None:
    done = shell(f"{SCRIPT} report {copied(tmp_path)} --json --no-input")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    (fit,) = record().events(ev.FitFinished)
    assert found["key_numbers"][3]["value"] == f"{fit.rms_px:.3f} px"
    assert np.isfinite([one["mean_sd_mm"] for one in found["uncertainties"]]).all()
