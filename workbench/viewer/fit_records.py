"""Records of a fit of a captures file, as a session would have written them: for its recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import isfinite, nan

from workbench.calibration.data.spot_rows import own_spots, sought
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.model import event as ev
from workbench.model.captures import BOARD, CaptureRow
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.model.target import FlatTarget, Placement
from workbench.session.capture_spots import find_row_spots

SECOND_NS = 1_000_000_000


def fit_records(
    name: str, rows: Sequence[CaptureRow], fitted: CalibrationFit, finished: ev.FitFinished
) -> Iterator[ev.Record]:
    """Records of the captures in the order of the file, one second apart, then of the fit.

    Args:
        name: name of the recording.
        rows: rows of the captures file that were fitted or rejected.
        fitted: the fit.
        finished: its result.
    """
    for n, event in enumerate(_events(name, rows, fitted, finished)):
        yield ev.Record(n=n, time_ns=n * SECOND_NS, event=event)


def _events(
    name: str, rows: Sequence[CaptureRow], fitted: CalibrationFit, finished: ev.FitFinished
) -> Iterator[ev.Event]:
    yield ev.SessionStarted(session=name, rig=fitted.rig.rig, procedures=("fit",))
    yield ev.StepStarted(procedure="fit", index=1, step="fit", title="Captures of the file", shots=len(rows))
    before: str | None = None
    parts = list(dict.fromkeys(row.part for row in rows))
    for row in rows:
        if row.laser_id == BOARD or not isfinite(row.standoff_mm):
            continue
        key = row.placement_key
        if key != before:
            target = FlatTarget(yaw_deg=row.tilt_deg if isfinite(row.tilt_deg) else 0.0)
            yield ev.TargetPlaced(placement=Placement(key=key, standoff_mm=row.standoff_mm, target=target))
            before = key
        source = f"row {row.row}"
        yield _capture(row, source, key, parts.index(row.part))
        yield _spots(row, source, fitted.rig)
    yield finished
    yield ev.SessionFinished(exit_code=0, message=f"calibration {finished.verdict}")


def _capture(row: CaptureRow, source: str, placement_key: str, part: int) -> ev.CaptureTaken:
    time_ns = row.row * SECOND_NS
    return ev.CaptureTaken(
        key=source,
        purpose="calibration",
        laser_id=row.laser_id,
        placement_key=placement_key,
        standoff_mm=row.standoff_mm,
        repeat=row.repeat,
        on=ev.FrameRef(path="" if row.on is None else str(row.on), sha256="", time_ns=time_ns),
        off=None if row.off is None else ev.FrameRef(path=str(row.off), sha256="", time_ns=time_ns),
        exposure=row.exposure if isfinite(row.exposure) else None,
        exposure_unit=row.exposure_unit or None,
        clock_ns=round(row.time_s * SECOND_NS) if isfinite(row.time_s) else None,
        part=part,
    )


def _spots(row: CaptureRow, source: str, rig: Rig) -> ev.SpotsFound:
    """The spots in the images of a row, or the position that it states."""
    if row.on is None or row.laser_id not in rig.laser_ids:
        sd = rig.noise.spot_sd_px
        stated = Spot(
            row.u_px,
            row.v_px,
            row.u_sd_px if isfinite(row.u_sd_px) else sd,
            row.v_sd_px if isfinite(row.v_sd_px) else sd,
            flux_dn=nan,
            width_px=nan,
            peak_dn=nan,
            laser_id=row.laser_id,
        )
        seen = isfinite(row.u_px) and isfinite(row.v_px)
        return ev.SpotsFound(key=source, spots=(stated,) if seen else ())
    size = rig.camera.width_px, rig.camera.height_px
    laser = rig.lasers[rig.laser_ids.index(row.laser_id)]
    found = own_spots(rig, laser, find_row_spots(row, size, *sought(rig, laser), rig.noise.speckle_sd_px))
    spots = tuple(replace(spot, laser_id=row.laser_id) for spot in found.spots)
    return ev.SpotsFound(key=source, spots=spots, failures=tuple(found.failures))
