"""Data frames of a session from its events: captures, spots, residuals, readings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from workbench.model.event import CaptureTaken, FitFinished, FrameRef, ReadingTaken, SpotsFound
from workbench.report.frames import (
    CAPTURE_COLUMNS,
    CROSS_VALIDATION_COLUMNS,
    READING_COLUMNS,
    RESIDUAL_COLUMNS,
    SPOT_COLUMNS,
    frame_of,
)


def captures_frame(folder: Path, events: Iterable[object]) -> pd.DataFrame:
    """One row per capture, in order of time; `on` and `off` are the paths of its frames.

    Args:
        folder: folder of the session.
        events: events that are in effect.
    """
    captures = _captures(events).values()
    return frame_of((_capture_row(folder, event) for event in captures), CAPTURE_COLUMNS)


def spots_frame(events: Sequence[object]) -> pd.DataFrame:
    """One row per spot; pixels, digital numbers (DN), 1 sigma.

    The origin is the centre of the top-left pixel. `laser_id` is that of the capture. It is empty
    where several lasers were on and the spot is not assigned. `flags` are names separated by spaces.
    """
    captures = _captures(events)
    found = {event.key: event for event in events if isinstance(event, SpotsFound)}
    rows = (row for event in found.values() for row in _spot_rows(captures[event.key], event))
    return frame_of(rows, SPOT_COLUMNS)


def residuals_frame(events: Iterable[object]) -> pd.DataFrame:
    """Residuals of the last fit, observed - predicted: one row per laser and placement, px, 1 sigma."""
    rows = (record.model_dump() for fit in _last_fit(events) for record in fit.residuals)
    return frame_of(rows, RESIDUAL_COLUMNS)


def cross_validation_frame(events: Iterable[object]) -> pd.DataFrame:
    """Placements of the last fit, each ranged by the fit without it; mm, 1 sigma as that fit predicts it."""
    rows = (
        {name: getattr(placement, name) for name in CROSS_VALIDATION_COLUMNS}
        for fit in _last_fit(events)
        for placement in fit.left_out
    )
    return frame_of(rows, CROSS_VALIDATION_COLUMNS)


def readings_frame(events: Iterable[object]) -> pd.DataFrame:
    """Readings of all trials; mm, 1 sigma, error = measured - true."""
    rows = (_reading_row(event) for event in events if isinstance(event, ReadingTaken))
    return frame_of(rows, READING_COLUMNS)


def _last_fit(events: Iterable[object]) -> list[FitFinished]:
    """The last fit, or nothing."""
    return [event for event in events if isinstance(event, FitFinished)][-1:]


def _captures(events: Iterable[object]) -> dict[str, CaptureTaken]:
    """By key."""
    return {event.key: event for event in events if isinstance(event, CaptureTaken)}


def _capture_row(folder: Path, event: CaptureTaken) -> dict[str, object]:
    return {
        "capture": event.key,
        "purpose": event.purpose,
        "placement": event.placement_key,
        "scene": event.scene or "",
        "laser_id": event.laser_id,
        "standoff_mm": event.standoff_mm,
        "standoff_sd_mm": event.standoff_sd_mm,
        "repeat": event.repeat,
        "exposure": event.exposure,
        "exposure_unit": event.exposure_unit or "",
        "time": pd.Timestamp(event.on.time_ns, unit="ns", tz="UTC"),
        "on": _path(folder, event.on),
        "off": _path(folder, event.off),
    }


def _path(folder: Path, frame: FrameRef | None) -> str:
    return "" if frame is None else str((folder / frame.path).resolve())


def _spot_rows(capture: CaptureTaken, event: SpotsFound) -> list[dict[str, object]]:
    alone = capture.laser_id not in {"all", "board"}
    return [
        {
            "capture": event.key,
            "laser_id": spot.laser_id or (capture.laser_id if alone else ""),
            "standoff_mm": capture.standoff_mm,
            "repeat": capture.repeat,
            "u_px": spot.u_px,
            "v_px": spot.v_px,
            "u_sd_px": spot.u_sd_px,
            "v_sd_px": spot.v_sd_px,
            "u_speckle_sd_px": spot.u_speckle_sd_px,
            "v_speckle_sd_px": spot.v_speckle_sd_px,
            "flux_dn": spot.flux_dn,
            "width_px": spot.width_px,
            "peak_dn": spot.peak_dn,
            "flags": " ".join(sorted(spot.flags)),
        }
        for spot in event.spots
    ]


def _reading_row(event: ReadingTaken) -> dict[str, object]:
    shown = event.model_dump(include=set(READING_COLUMNS))
    return shown | {"true_mm": event.reference_mm, "error_mm": event.error_mm, "cause": event.cause}
