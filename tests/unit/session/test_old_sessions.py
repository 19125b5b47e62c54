"""Sessions recorded by version 0.1.0 are read: listed, shown, fitted and ranged as they were."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.viewer.readback import Contents
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.model.calibration import load_calibration
from workbench.model.captures import load_captures
from workbench.model.event import TrialFinished, TrialProgress
from workbench.model.nested import fix_parameters
from workbench.ranging.captures import read_captures
from workbench.ranging.ranger import Ranger
from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import session_status
from workbench.viewer.recording import rebuild

DATA = Path(__file__).parents[3] / "data"
SESSION, SIMULATION = DATA / "session-0.1.0", DATA / "simulation-0.1.0"


def finished(session: Path) -> TrialFinished:
    (event,) = [r.event for r in read_journal(session) if isinstance(r.event, TrialFinished)]
    return event


@pytest.mark.parametrize(("session", "captures"), [(SESSION, 7), (SIMULATION, 0)])
def test_status(session: Path, captures: int) -> None:
    status = session_status(session)
    assert (status.state, status.captures) == ("finished", captures)


def test_the_table_of_the_accuracy_trial_has_the_numbers_of_its_csv_file() -> None:
    (table,) = finished(SESSION).tables
    old = pd.read_csv(SESSION / "reference.8.csv")
    assert [column.key for column in table.columns] == list(old.columns)
    (row,) = table.rows
    # One reading has no standard deviation: empty in the file.
    assert [value for value in row if value is not None] == [v for v in old.iloc[0].tolist() if v == v]


def test_the_claims_of_the_simulation_are_a_table() -> None:
    events = [record.event for record in read_journal(SIMULATION)]
    assert sum(isinstance(event, TrialProgress) for event in events) == 2
    (table,) = finished(SIMULATION).tables
    old = pd.read_csv(SIMULATION / "reference-simulation.1.csv")
    assert len(table.rows) == len(old) == 3
    keys = [column.key for column in table.columns]
    assert [row[keys.index("ours")] for row in table.rows] == pytest.approx(old["ours"].tolist(), rel=1e-12)


def test_the_recording_is_made_again(tmp_path: Path) -> None:
    session = tmp_path / "session"
    shutil.copytree(SESSION, session)
    rebuild(session, load_session_rig(session), read_journal(session), session / "recording.rrd")
    contents = Contents(session / "recording.rrd")
    assert len(contents.values("/frame/image", "EncodedDepthImage:blob")) == 7
    (trial,) = {entity.split("/")[2] for entity in contents.entities if entity.startswith("/trials/")}
    assert "800" in contents.static(f"/trials/{trial}/tables", "TextDocument:text")[-1][0]


def test_the_fit_of_its_captures_is_its_calibration() -> None:
    """By the model of then: the lens centred, no tilt common to all placements."""
    rig = fix_parameters(load_session_rig(SESSION), ("p1", "p2", "target_slope_x"))
    fitted = fit_calibration(rig, *observations_of_rows(rig, load_captures(SESSION / "captures.csv")))
    old = load_calibration(SESSION / "calibration.yaml").geometry()
    parameters, sensor = fitted.table.parameters[fitted.sensor], fitted.sensor
    now = {
        p.name: pair for p, *pair in zip(parameters, fitted.values[sensor], fitted.sd[sensor], strict=True)
    }
    assert set(old) <= set(now)
    # Since then terms are dropped by other rules, and spots are fitted with speckle in their variance, which
    # takes a quarter of the variance away: what stays moves by a part of its deviation.
    for name, value in old.items():
        assert abs(value - now[name][0]) <= now[name][1]


def test_its_calibration_ranges_its_trial() -> None:
    ranger = Ranger(load_calibration(SESSION / "calibration.yaml"))
    (reading,) = read_captures(ranger, load_captures(SESSION / "trial-captures.csv"))
    old = pd.read_csv(SESSION / "reference.8.csv")
    assert reading.flat_mm is not None
    assert reading.flat_spot_sd_mm is not None
    # The spots' centres are fitted with other weights since then.
    assert abs(reading.flat_mm - 800.0 - old["mean_error_mm"][0]) <= reading.flat_spot_sd_mm
