"""Calibrations of a sensor over time: which is in force, and the change of ranges against another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.report.certificate.session_record import unchanged
from workbench.sensor.calibrated import CalibratedSensor
from workbench.session.index import IndexedSession
from workbench.session.sensor_log import SensorEntry

FIVE_MM = (200.0, 500.0, 1000.0, 2000.0, 4000.0)
"""Distances at which calibrations are compared."""


@dataclass(frozen=True)
class DatedCalibration:
    """A calibration that a session exported."""

    session: str
    day: str
    path: Path
    sha256: str
    calibration: Calibration


@dataclass(frozen=True)
class InForce:
    """The calibration in force."""

    calibration: DatedCalibration
    since: str
    why: str
    by: str
    """Operator who put it in force; empty: the newest one is in force."""


@dataclass(frozen=True)
class RangeChange:
    """Change of the mean range of the lasers between two calibrations, at one distance; mm, 1 sigma."""

    range_mm: float
    change_mm: float
    sd_mm: float


def dated_calibrations(sessions: Sequence[IndexedSession]) -> tuple[list[DatedCalibration], list[str]]:
    """Usable calibrations of the sessions, in order of time, and remarks on the files of others."""
    found, remarks = [], []
    for one in sessions:
        if not one.calibration or one.verdict not in {"accepted", "exception"}:
            continue
        path = one.status.session_dir / one.calibration
        try:
            found.append(dated(unchanged(path, one.calibration_sha256), one.name, one.began[:10]))
        except BadInputError as error:
            remarks.append(str(error))
    return found, remarks


def dated(path: Path, session: str, day: str) -> DatedCalibration:
    """Read a calibration.

    Raises:
        BadInputError: the file is missing or wrong.
    """
    calibration = load_calibration(path)
    return DatedCalibration(session, day, path, file_sha256(path), calibration)


def in_force(
    folder: Path, calibrations: Sequence[DatedCalibration], entries: Sequence[SensorEntry]
) -> InForce | None:
    """The calibration that was put in force last, else the newest one; None if there is none.

    Raises:
        BadInputError: the file that was put in force is missing, or has changed since.
    """
    chosen = [one for one in entries if one.kind == "in_force"]
    if not chosen:
        if not calibrations:
            return None
        newest = calibrations[-1]
        return InForce(newest, newest.day, "the newest accepted calibration", "")
    last = chosen[-1]
    path = folder / last.path
    found = dated(path, path.parent.name, "")
    if found.sha256 != last.sha256:
        raise BadInputError(
            f"{path}: expected the calibration put in force on {last.time[:10]} (sha256"
            f" {last.sha256[:12]}), the file has changed; restore it, or put another one in force with"
            " `workbench use`"
        )
    made = found.calibration.laser_ranger.provenance.created[:10]
    calibration = DatedCalibration(found.session, made, path, found.sha256, found.calibration)
    return InForce(calibration, last.time[:10], last.text, last.operator)


def range_changes(before: Calibration, after: Calibration) -> tuple[RangeChange, ...]:
    """Mean change at the five distances, as far as both calibrations cover them.

    The range by `after` of the spot that `before` predicts, minus the range; the mean of the lasers that see
    it, weighted equally. The standard deviations of both calibrations are taken as independent.
    """
    a, b = CalibratedSensor(before), CalibratedSensor(after)
    spans = [c.laser_ranger.validity.standoff_mm for c in (before, after)]
    nearest, farthest = max(s[0] for s in spans), min(s[1] for s in spans)
    changes = []
    for range_mm in FIVE_MM:
        at = np.array([range_mm])
        ids = [i for i in a.ids if i in b.ids and a.in_frame(i, at)[0]]
        if nearest <= range_mm <= farthest and ids:
            changes.append(_change(a, b, ids, range_mm))
    return tuple(changes)


def compared(before: Calibration, after: Calibration) -> Comparison | None:
    """Test whether the sensor changed; None if the calibrations cannot be compared."""
    try:
        return compare(before, after)
    except BadInputError:
        return None


def _change(a: CalibratedSensor, b: CalibratedSensor, ids: list[str], range_mm: float) -> RangeChange:
    spots = np.concatenate([a.spot_px(i, np.array([range_mm])) for i in ids])
    typical = np.full_like(spots, np.nan)
    share = np.full(len(ids), 1 / len(ids))
    by_a, by_b = (sensor.ranges(ids, spots, typical) for sensor in (a, b))
    variance = 0.0
    for found in (by_a, by_b):  # the spots are equal: only the calibrations' uncertainty counts
        own = found.covariance_mm2 - np.diag(found.spot_sd_mm**2)
        variance += float(share @ own @ share)
    return RangeChange(range_mm, float(share @ (by_b.range_mm - range_mm)), float(np.sqrt(variance)))
