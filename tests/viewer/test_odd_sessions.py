"""Sessions that do not go as they should are recorded too."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest

from tests.viewer.readback import Contents
from tests.viewer.session import a_fit, a_rig
from workbench.figures.picture import note
from workbench.model import event as ev
from workbench.model.spot import Failure, Spot
from workbench.model.target import (
    CylinderTarget,
    FlatTarget,
    NoTarget,
    Placement,
    PolynomialTarget,
    TargetShape,
)
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.accuracy.tables import accuracy_table
from workbench.viewer.recording import RecordingConsumer
from workbench.viewer.scene import DRAWN_DEPTH_MM
from workbench.viewer.window import viewer_environment, viewer_executable

STARTED = ev.SessionStarted(session="odd", rig="made-up", procedures=("p",))


def record(folder: Path, events: Sequence[ev.Event]) -> Contents:
    with RecordingConsumer(folder, a_rig()) as consumer:
        for n, event in enumerate(events):
            consumer(ev.Record(n=n, time_ns=1_790_000_000_000_000_000 + n, event=event))
    return Contents(folder / "recording.rrd")


def a_capture(folder: Path, key: str, standoff_mm: float = 500.0) -> ev.CaptureTaken:
    path = folder / f"{key}.png"
    cv2.imwrite(str(path), np.full((480, 640), 7, dtype=np.uint8))
    return ev.CaptureTaken(
        key=key,
        purpose="calibration",
        laser_id="L1",
        placement_key="p",
        standoff_mm=standoff_mm,
        repeat=0,
        on=ev.FrameRef(
            path=path.name,
            sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
            time_ns=1_790_000_000_000_000_000,
        ),
    )


def a_reading(
    standoff_mm: float, status: Literal["not_enough_points", "no_points"], *lasers: ev.LaserRange
) -> ev.ReadingTaken:
    """Without a range."""
    return ev.ReadingTaken(
        trial="t",
        scene="s",
        standoff_mm=standoff_mm,
        reading=1,
        status=status,
        range_mm=None,
        sigma_mm=None,
        lasers=lasers,
    )


def a_spot(laser: str | None, u_px: float) -> Spot:
    return Spot(
        laser_id=laser,
        u_px=u_px,
        v_px=240.0,
        u_sd_px=0.1,
        v_sd_px=0.1,
        flux_dn=1.0,
        width_px=1.0,
        peak_dn=1.0,
        flags=frozenset({Failure.SATURATED}),
    )


def test_capture_without_spots_says_why_and_clears_the_picture(tmp_path: Path) -> None:
    events: list[ev.Event] = [
        STARTED,
        a_capture(tmp_path, "a"),
        ev.SpotsFound(key="a", spots=(), failures=("L1: too dim",)),
    ]
    contents = record(tmp_path, events)
    assert contents.values("/frame/spots", "Points2D:positions") == [(1, [])]
    assert contents.values("/steps/log", "TextLog:text")[-1] == (1, ["Capture a: L1: too dim"])
    assert contents.values("/steps/log", "TextLog:level")[-1] == (1, ["WARN"])


def test_spots_without_a_laser_are_kept_together(tmp_path: Path) -> None:
    spots = (a_spot(None, 100.0), a_spot(None, 300.0), a_spot("a laser / of another rig", 5.0))
    contents = record(
        tmp_path,
        [
            STARTED,
            ev.TargetPlaced(placement=Placement(key="p", standoff_mm=500.0)),
            a_capture(tmp_path, "a"),
            ev.SpotsFound(key="a", spots=spots),
        ],
    )
    assert contents.values("/spots/unassigned/u_px", "Scalars:scalars") == [(1, [100.0, 300.0])]
    (labels,) = contents.values("/frame/spots", "Points2D:labels")
    assert labels[1][1:] == ["? (saturated)", "? (saturated)"]
    (dots,) = contents.values("/bench/spots/unassigned", "Points3D:positions")
    assert len(dots[1]) == 2


def test_reading_names_the_spots_of_its_picture(tmp_path: Path) -> None:
    spots = ev.SpotsFound(key="a", spots=(a_spot(None, 100.0), a_spot(None, 300.0)))
    unseen = ev.LaserRange(laser_id="L3", range_mm=499.0, sigma_mm=1.0, u_px=None, v_px=None)
    seen = unseen.model_copy(update={"laser_id": "L2", "u_px": 300.0, "v_px": 240.0})
    reading = a_reading(500.0, "not_enough_points", unseen, seen)
    contents = record(tmp_path, [STARTED, a_capture(tmp_path, "a"), spots, reading])
    labels = contents.values("/frame/spots", "Points2D:labels", "time")
    assert [label for _, label in labels] == [
        ["? (saturated)", "? (saturated)"],
        ["? (saturated)", "L2 (saturated)"],
    ]
    assert labels[0][0] == labels[1][0]


def test_spots_found_late_belong_to_their_own_capture(tmp_path: Path) -> None:
    late = ev.SpotsFound(key="a", spots=(a_spot("L1", 10.0),))
    events: list[ev.Event] = [STARTED, a_capture(tmp_path, "a"), a_capture(tmp_path, "b", 900.0), late]
    contents = record(tmp_path, events)
    assert contents.values("/spots/u_px/L1", "Scalars:scalars") == [(1, [10.0])]
    assert contents.values("/spots/u_px/L1", "Scalars:scalars", "standoff_mm") == [(500, [10.0])]


@pytest.mark.parametrize(
    ("target", "strips"),
    [
        (FlatTarget(yaw_deg=10.0, pitch_deg=-5.0), 3),
        (CylinderTarget(diameter_mm=120.0), 5),
        (PolynomialTarget(coefficients=(0.1, 0.001)), 5),
        (NoTarget(), 0),
    ],
)
def test_every_target_is_drawn(tmp_path: Path, target: TargetShape, strips: int) -> None:
    placed = ev.TargetPlaced(placement=Placement(key="p", standoff_mm=500.0, target=target))
    contents = record(tmp_path, [STARTED, placed, a_capture(tmp_path, "a"),
                                 ev.SpotsFound(key="a", spots=(a_spot("L1", 250.0),))])  # fmt: skip
    ((_, outline),) = contents.values("/bench/target", "LineStrips3D:strips")
    assert len(outline) == strips
    nearest = min((point[2] for strip in outline for point in strip), default=None)
    if isinstance(target, CylinderTarget):
        assert nearest == pytest.approx(DRAWN_DEPTH_MM)


def test_refused_fit_of_one_axis_and_readings_without_range(tmp_path: Path) -> None:
    whole = a_fit()
    residuals = tuple(one.model_copy(update={"v_px": None, "v_sd_px": None}) for one in whole.residuals)
    refused = whole.model_copy(
        update={"verdict": "refused", "reasons": ("rms too large",), "warnings": (), "residuals": residuals}
    )
    reading = a_reading(4500.0, "no_points")
    finished = ev.SessionFinished(exit_code=3, message="refused")
    row = AccuracyRow(standoff_mm=4500.0, readings=0, missing=1, reference_sd_mm=2.0)
    table = ev.TrialFinished(trial="t", tables=(accuracy_table("t", [row]),))
    contents = record(tmp_path, [STARTED, refused, reading, table, finished])
    assert contents.static("/fit/picture/v/image", "EncodedImage:blob")[-1] == note("v was not measured")
    assert "/fit/residuals/v_px/L1" not in contents.entities
    log = dict(enumerate(contents.values("/steps/log", "TextLog:level")))
    assert [level for _, (level,) in log.values()] == ["INFO", "ERROR", "WARN", "INFO", "ERROR"]
    (text,) = contents.static("/trials/t/tables", "TextDocument:text")[-1]
    assert "4500 mm, reading 1: no spot was seen" in text
    assert "4500  0" in text
    assert text.rstrip().count("2.00") == 1


def test_frames_survive_a_kill(tmp_path: Path) -> None:
    """See `killed.py`: the process ends without closing anything."""
    subprocess.run([sys.executable, "-m", "tests.viewer.killed", str(tmp_path)], check=False, timeout=60)
    whole = tmp_path / "whole.rrd"
    command = [str(viewer_executable()), "rrd", "merge", str(tmp_path / "recording.rrd"), "-o", str(whole)]
    environment = {**viewer_environment(), "HOME": str(tmp_path)}
    subprocess.run(command, check=True, timeout=60, env=environment, capture_output=True)
    frames = Contents(whole).values("/frame/image", "EncodedDepthImage:blob")
    stored = [path.read_bytes() for path in sorted((tmp_path / "frames").glob("*-on.png"))]
    assert len(stored) == 8
    assert [png for _, png in frames] == stored
