"""A fit as the journal and the viewer see it."""

from __future__ import annotations

from workbench.calibration.checks.cross_validation import alarms
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.assessment import Assessment, determined_by
from workbench.model.fit_event import (
    FitFinished,
    LeftOutRecord,
    ParameterRecord,
    RejectedRecord,
    ResidualRecord,
)


def parameter_records(fit: CalibrationFit) -> tuple[ParameterRecord, ...]:
    """The sensor's parameters; constants (prior sd 0) are among them."""
    sensor = fit.sensor
    columns = zip(
        fit.table.parameters[sensor],
        fit.values[sensor].tolist(),
        fit.sd[sensor].tolist(),
        fit.data_share[sensor].tolist(),
        determined_by(fit)[sensor],
        strict=True,
    )
    return tuple(
        ParameterRecord(
            name=parameter.name,
            unit=parameter.unit,
            value=value,
            sd=sd,
            prior_value=parameter.prior.value,
            prior_sd=parameter.prior.sd,
            data_share=share,
            determined_by=by,
        )
        for parameter, value, sd, share, by in columns
    )


def fit_finished(fit: CalibrationFit, assessment: Assessment) -> FitFinished:
    """The event of a finished fit."""
    return FitFinished(
        parameters=parameter_records(fit),
        residuals=_residuals(fit),
        rms_px=fit.rms_px,
        observations=len(fit.used),
        rejected=tuple(RejectedRecord(source=r.source, reason=r.reason) for r in fit.rejected),
        verdict=assessment.verdict,
        reasons=assessment.reasons,
        warnings=assessment.warnings,
        terms=fit.terms,
        left_out=left_out_records(assessment),
        faults=assessment.faults,
        residual_tests=assessment.residual_tests,
    )


def left_out_records(assessment: Assessment) -> tuple[LeftOutRecord, ...]:
    """The cross-validation."""
    alarmed = alarms(assessment.left_out)
    return tuple(
        LeftOutRecord(
            placement=one.placement,
            standoff_mm=one.standoff_mm,
            error_mm=one.error_mm,
            sd_mm=one.sd_mm,
            lasers=one.lasers,
            alarm=one in alarmed,
        )
        for one in assessment.left_out
    )


def _residuals(fit: CalibrationFit) -> tuple[ResidualRecord, ...]:
    cells = fit.cells
    columns = zip(
        cells.laser.tolist(),
        cells.placement.tolist(),
        fit.residual_px.tolist(),
        cells.sd_px.tolist(),
        strict=True,
    )
    return tuple(
        ResidualRecord(
            laser_id=fit.rig.laser_ids[laser],
            standoff_mm=cells.placements[placement].standoff_mm,
            u_px=_measured(u),
            v_px=_measured(v),
            u_sd_px=_measured(u_sd),
            v_sd_px=_measured(v_sd),
        )
        for laser, placement, (u, v), (u_sd, v_sd) in columns
    )


def _measured(value: float) -> float | None:
    return None if value != value else value
