"""Records of a fit for the journal, the tables and the viewer."""

from __future__ import annotations

from math import isfinite

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.assessment import Assessment, determined_by
from workbench.model.fit_event import FitFinished, ParameterRecord, Rejected, ResidualRecord


def parameter_records(fit: CalibrationFit) -> tuple[ParameterRecord, ...]:
    """The sensor's parameters in the order of `Layout`, constants (prior sd 0) included."""
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
    """The event of a finished fit, with plain records only: a resumed session compares events."""
    return FitFinished(
        parameters=parameter_records(fit),
        residuals=_residuals(fit),
        rms_px=fit.rms_px,
        observations=len(fit.used),
        rejected=tuple(Rejected(r.source, r.reason) for r in fit.rejected),
        verdict=assessment.verdict,
        reasons=assessment.reasons,
        warnings=assessment.warnings,
        terms=fit.terms,
        left_out=assessment.cross_validation,
        faults=assessment.faults,
        residual_tests=assessment.residual_tests,
        needs_standoffs=assessment.needs_standoffs,
        drift_px=(float(fit.drift_px[0]), float(fit.drift_px[1])),
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
            u_px=_finite_or_none(u),
            v_px=_finite_or_none(v),
            u_sd_px=_finite_or_none(u_sd),
            v_sd_px=_finite_or_none(v_sd),
            placement=cells.placements[placement].key,
        )
        for laser, placement, (u, v), (u_sd, v_sd) in columns
    )


def _finite_or_none(value: float) -> float | None:
    return value if isfinite(value) else None
