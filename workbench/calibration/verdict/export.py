"""Calibration of a fit, and its YAML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.data.observations import positions, stated_sd, stated_speckle_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.assessment import Assessment, assess
from workbench.calibration.verdict.camera_info import camera_info, parameters
from workbench.calibration.verdict.observability import RangeGradients, null_directions
from workbench.calibration.verdict.yaml_text import yaml_text
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import (
    Calibration,
    CrossValidatedRange,
    FitSummary,
    LaserRanger,
    LaserRay,
    Noise,
    Provenance,
    ReferencePlane,
    Validity,
)
from workbench.model.errors import LimitFailedError
from workbench.model.rig import nearest_image_axis
from workbench.sensor.calibrated import CalibratedSensor
from workbench.session.files import write_output


def calibrate(
    fit: CalibrationFit, limits: Acceptance, provenance: Provenance, notes: Sequence[str] = ()
) -> tuple[Calibration, Assessment]:
    """Make the calibration of a fit, and assess it.

    Args:
        fit: the fit.
        limits: limits of the calibration.
        provenance: source of the data.
        notes: warnings about the captures, which come before those of the fit.

    Raises:
        LimitFailedError: no spot in the image has a range with a finite standard deviation.
    """
    values = dict(zip((p.name for p in fit.table.parameters), fit.values.tolist(), strict=True))
    provisional = _calibration(fit, values, provenance, Assessment("accepted", (), ()), 0.0)
    ranges = _ranges(CalibratedSensor(provisional))
    placements = leave_each_out(fit)
    # Few placements do not support what the fit states: the worse of fit and cross-validation counts.
    predicted = [one.sd_mm / one.standoff_mm for one in placements]
    worst = float(max([ranges.sd.max(), *predicted])) if len(ranges.sd) else float("nan")
    if not np.isfinite(worst):
        raise LimitFailedError(
            "no calibration: no laser has a range with a finite uncertainty in the image between the nearest"
            " and the farthest standoff. Check image size and baselines in the rig file, and the standoffs"
        )
    sensor = fit.sensor
    directions = null_directions(
        fit.rig,
        fit.table.parameters[sensor],
        fit.values[sensor],
        fit.covariance[sensor, sensor],
        ranges,
    )
    assessment = assess(fit, limits, worst, placements, directions)
    assessment = replace(assessment, warnings=(*notes, *assessment.warnings))
    return _calibration(fit, values, provenance, assessment, worst), assessment


def accept_with_reason(calibration: Calibration, reason: str) -> Calibration:
    """A refused calibration with the operator's reason for using it."""
    ranger = calibration.laser_ranger
    summary = ranger.fit.model_copy(update={"accepted_because": reason})
    return calibration.model_copy(update={"laser_ranger": ranger.model_copy(update={"fit": summary})})


def write_calibration(path: Path, calibration: Calibration) -> None:
    """Write the YAML to a path that the user names.

    Raises:
        BadInputError: see `write_output`.
    """
    write_output(path, render(calibration).encode())


def render(calibration: Calibration) -> str:
    """The YAML text."""
    return yaml_text(calibration.model_dump())


def _calibration(
    fit: CalibrationFit,
    values: dict[str, float],
    provenance: Provenance,
    assessment: Assessment,
    worst: float,
) -> Calibration:
    standoffs = [s.standoff_mm for s in fit.used]
    return Calibration(
        **camera_info(fit).model_dump(),
        laser_ranger=LaserRanger(
            format=1,
            reference_plane=ReferencePlane(offset_mm=values["offset_mm"]),
            lasers=tuple(
                LaserRay(
                    id=laser.id,
                    axis=nearest_image_axis(laser),
                    origin_mm=(values[f"{laser.id}.x_mm"], values[f"{laser.id}.y_mm"], 0.0),
                    direction=(values[f"{laser.id}.tx"], values[f"{laser.id}.ty"], 1.0),
                )
                for laser in fit.rig.lasers
            ),
            noise=Noise(
                spot_sd_px=_typical_spot_sd(fit),
                speckle_sd_px=_typical_speckle_sd(fit),
            ),
            parameters=parameters(fit, fit.sensor),
            validity=Validity(standoff_mm=(min(standoffs), max(standoffs)), max_relative_range_sd=worst),
            fit=FitSummary(
                rms_px=fit.rms_px,
                observations=len(fit.used),
                rejected=len(fit.rejected),
                noise_scale=fit.noise_scale,
                placement_scale=fit.placement_scale,
                noise_degrees_of_freedom=_finite_or_none(fit.noise_freedom),
                placement_degrees_of_freedom=_finite_or_none(fit.placement_freedom),
                verdict=assessment.verdict,
                reasons=assessment.reasons,
                warnings=assessment.warnings,
                terms=fit.terms,
                cross_validation=tuple(
                    CrossValidatedRange(standoff_mm=one.standoff_mm, error_mm=one.error_mm, sd_mm=one.sd_mm)
                    for one in assessment.cross_validation
                    if one.error_mm is not None
                ),
            ),
            provenance=provenance,
        ),
    )


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _typical_spot_sd(fit: CalibrationFit) -> float:
    """Root mean square sd of a single spot, as stated and scaled to the scatter of the data, px."""
    sd, seen = stated_sd(fit.used, fit.rig.noise), np.isfinite(positions(fit.used))
    return float(np.sqrt((sd[seen] ** 2).mean()) * fit.cells.repeat_scale * fit.noise_scale)


def _typical_speckle_sd(fit: CalibrationFit) -> float:
    """Root mean square sd by speckle, scaled to the scatter of the data, px."""
    sd, seen = stated_speckle_sd(fit.used, fit.rig.noise), np.isfinite(positions(fit.used))
    return float(np.sqrt((sd[seen] ** 2).mean()) * fit.noise_scale)


def _ranges(sensor: CalibratedSensor) -> RangeGradients:
    """Relative sd and gradients of the ranges of all lasers, where their spots are in the image."""
    nearest, farthest = sensor.calibration.laser_ranger.validity.standoff_mm
    grid = np.geomspace(nearest, farthest, 30)
    rows, sd = [], []
    # The whole grid at once: arrays of one shape need one compiled program.
    with np.errstate(invalid="ignore", over="ignore"):
        for laser_id in sensor.ids:
            found, seen = sensor.typical_ranges(laser_id, grid), sensor.in_frame(laser_id, grid)
            rows.append((found.by_parameter / grid[:, None])[seen])
            sd.append((found.sigma_mm / grid)[seen])
    return RangeGradients(np.concatenate(rows), np.concatenate(sd))
