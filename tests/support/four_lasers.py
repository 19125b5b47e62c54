"""Noise-free rig of four lasers beside the camera for tests of trials, and readings of such trials."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.exact import calibration_of
from tests.support.ideal import exact, ideal_rig, laser
from tests.support.running import CY_PX, Running, running
from workbench.devices.protocols import Operator
from workbench.model.event import ReadingTaken, TrialFinished, TrueValues
from workbench.model.rig import Rig

X_MM = (-60.0, -30.0, 30.0, 60.0)


def four_laser_rig() -> Rig:
    """Four lasers of exactly known baselines in a low picture; targets are placed exactly."""
    lasers = [laser(f"L{n}", x_mm) for n, x_mm in enumerate(X_MM, start=1)]
    return ideal_rig(*lasers, camera={"height_px": 120, "cy_px": exact(CY_PX)})


@contextmanager
def calibrated(folder: Path, operator: Operator | None = None) -> Iterator[Running]:
    """Running session on the rig with its exact calibration."""
    with running(folder, four_laser_rig(), operator) as session:
        session.context.calibration = calibration_of(session.context.rig)
        yield session


def finished(session: Running) -> TrialFinished:
    """Results of the only trial of a session."""
    (event,) = [event for event in session.events if isinstance(event, TrialFinished)]
    return event


def reading(true: TrueValues | None, *, range_mm: float | None = None, **values: object) -> ReadingTaken:
    """Reading with a stated standard uncertainty of 0.5 mm and a reference uncertainty of 0.3 mm."""
    return ReadingTaken.model_validate(
        {
            "trial": "t.1",
            "scene": "t.1/500mm/00",
            "standoff_mm": 500.0,
            "reading": 0,
            "status": "no_points" if range_mm is None else "done",
            "range_mm": range_mm,
            "sigma_mm": None if range_mm is None else 0.5,
            "closest_mm": range_mm,
            "closest_sigma_mm": None if range_mm is None else 0.5,
            "reference_sd_mm": 0.3,
            "true": true,
            "lasers": (),
            **values,
        }
    )
