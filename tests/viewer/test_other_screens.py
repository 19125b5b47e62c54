"""Screens of everything but a session in the real viewer: none is empty, none complains."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.support.campaigns import frames_of, simulated_campaign
from tests.support.rangers import spots, thesis_ranger
from tests.support.viewer_stream import bright_spot, drawn_frame
from tests.viewer.conftest import Recorded
from tests.viewer.harness import distinct_colors, headless_viewer
from tests.viewer.session import LASERS, a_rig
from workbench.model.calibration import load_calibration
from workbench.procedure.aiming import AimReading, Expected
from workbench.ranging.acquire import acquire
from workbench.report.aim_table import aim_table
from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective
from workbench.spots import Finding, Spot
from workbench.viewer.aim_view import AimView, aim_layout
from workbench.viewer.calibration_view import record_calibration
from workbench.viewer.comparison import Source, compare
from workbench.viewer.ranger_view import RangerView, Shown, ranger_layout
from workbench.viewer.recording import rebuild
from workbench.viewer.results_view import record_results
from workbench.viewer.stream import Stream

pytestmark = pytest.mark.thorough
DATA = Path(__file__).parents[2] / "data"
(SIMULATION,) = DATA.glob("sessions/*-thesis-simulation")
DARK = drawn_frame([], 8.0).astype(np.uint8)
RANGES_MM = {"L1": 812.0, "L2": 806.0, "L3": 794.0, "L4": 788.0}
"""An incline."""


def record_live_ranger(_: Recorded, out: Path) -> None:
    ranger = thesis_ranger()
    stream = Stream(out, "range", ranger_layout(a_rig()))
    view = RangerView(stream, a_rig(), ranger)
    for nearer_mm in (0.0, 2.0, 4.0):
        seen = spots(ranger, {laser: range_mm - nearer_mm for laser, range_mm in RANGES_MM.items()})
        on = drawn_frame([bright_spot(None, one.u_px, one.v_px, 120.0) for one in seen], 8.0)
        reading = acquire(ranger, "s", partial(_found, tuple(seen)))
        view.take(Shown(reading, on.astype(np.uint8), DARK, tuple(seen)))
    view.close()


def _found(seen: tuple[Spot, ...], _: object) -> Finding:
    return Finding(seen)


def record_aim(_: Recorded, out: Path) -> None:
    view = AimView(Stream(out, "aim", aim_layout(a_rig())), a_rig())
    for _number in range(3):
        readings = []
        for n, laser in enumerate(LASERS):
            spot = bright_spot(None, 200.0 + 60.0 * n, 240.0, 100.0)
            on = drawn_frame([spot], 8.0).astype(np.uint8)
            readings.append(AimReading(laser, on, DARK, spot, (), 8.0, Expected(spot.u_px + 5.0, 240.0), 1.5))
        view.take((tuple(readings), aim_table(readings, {}, "Lasers")))
    view.close()


def record_comparison(recorded: Recorded, out: Path) -> None:
    one, other = (
        Source(name, recorded.folder, recorded.rig, recorded.records) for name in ("first", "second")
    )
    compare([one, other], out)


def record_simulation(_: Recorded, out: Path) -> None:
    rebuild(SIMULATION, load_session_rig(SIMULATION), effective(read_journal(SIMULATION)), out)


def record_campaign(_: Recorded, out: Path) -> None:
    campaign = simulated_campaign(out.parent)
    summary = campaign.file.work.summarise(campaign.inputs, frames_of(campaign))
    record_results(out, "c", summary.headline, summary.tables, summary.charts, summary.colors)


def record_of_calibration(_: Recorded, out: Path) -> None:
    record_calibration(load_calibration(DATA / "session-0.1.0/calibration.yaml"), "c", out)


@pytest.mark.parametrize(
    "record",
    [
        record_live_ranger,
        record_aim,
        record_comparison,
        record_simulation,
        record_of_calibration,
        record_campaign,
    ],
)
def test_every_view_in_front_shows_something(
    recorded: Recorded, tmp_path: Path, record: Callable[[Recorded, Path], None]
) -> None:
    recording = tmp_path / "recording.rrd"
    record(recorded, recording)
    with headless_viewer(tmp_path, "1280x720") as viewer:
        viewer.open(recording)
        viewer.shot()
        front = viewer.views_in_front()
        assert len(front) >= 2
        for view in front:
            assert distinct_colors(viewer.glance(view.view_id)) > 30, view.name
        assert viewer.problems() == []
