"""Execution of `calibrate_head`: captures, fit, file of the head, tables and charts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.calibration.scanning.export import calibrated_head, eccentricity_deg, render
from workbench.calibration.scanning.fit import HeadFit, fit_head
from workbench.calibration.scanning.spots import head_spots
from workbench.model.chart import Axis, Chart, Series
from workbench.model.event import TrialProgress
from workbench.model.fit_event import Rejected
from workbench.model.head_calibration import HeadCalibration
from workbench.model.number_text import counted
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.session.files import write_record
from workbench.trials.limits import Result, check_results, skipped_results
from workbench.trials.results import finish_trial
from workbench.trials.scanning.calibrate_step import CalibrateHeadStep
from workbench.trials.scanning.moves import HeadCapture, sweep


def calibrate(context: Context, name: str, step: CalibrateHeadStep, placements: Sequence[Placement]) -> str:
    """Capture at every placement and angle, fit, and write the results; returns the outcome in one line.

    Raises:
        BadInputError: no spot is left to fit.
        LimitFailedError: the fit has no result, or a limit failed.
        WorkbenchError: see `visit_placements`.
    """
    swept = visit_placements(
        context, placements, lambda placed: sweep(context, placed, step.angles_deg, step.repeats)
    )
    captures = [one for captured in swept for one in captured]
    seen = [(one.found, one.reading_deg) for one in captures if not isinstance(one.found, Rejected)]
    spots, outliers = head_spots(context.rig, seen)
    fit = fit_head(context.rig, spots)
    head = calibrated_head(fit, context.provenance)
    for warning in head.scanning_head.fit.warnings:
        context.emit(TrialProgress(trial=name, text=warning))
    tables = [
        parameter_table(name, head, fit),
        move_table(name, fit),
        missing_table(name, captures, outliers),
    ]
    finish_trial(context, name, [one for one in tables if one.rows], residual_charts(name, fit))
    rms_px = head.scanning_head.fit.rms_px
    visited = {one.key for one in spots.placements}
    results = [
        Result("rms_px", "all moves", rms_px),
        Result("noise_scale", "all moves", fit.noise_scale),
        *skipped_results([one for one in placements if one.key not in visited], step.limits),
    ]
    check_results(context, name, results, step.limits)
    context.head = head
    write_record(context.session_dir / step.file, render(head).encode())
    return f"{counted(len(spots.placement), 'move')} of the head, rms {rms_px:.3f} px, {step.file} written"


def parameter_table(name: str, head: HeadCalibration, fit: HeadFit) -> Table:
    """Table of the fitted parameters, constants left out."""
    known = head.scanning_head.parameters
    columns = zip(
        known.names, known.units, known.values, known.sd, known.prior_sd, known.determined_by, strict=True
    )
    rows = [row for row in columns if row[4] > 0]
    amplitude, amplitude_sd, phase_sd = eccentricity_deg(fit)
    phase = "not determined" if phase_sd is None else f"known to {phase_sd:.2g} deg (1 sigma)"
    return Table(
        name=f"{name}-parameters",
        title="Calibrated head",
        columns=(
            Column(key="parameter", name="parameter"),
            Column(key="unit", name="unit"),
            Column(key="value", name="value", format="digits of sd"),
            Column(key="sd", name="sd", format="sd"),
            Column(key="prior_sd", name="prior sd", format="sd"),
            Column(key="determined_by", name="determined by"),
        ),
        rows=tuple(rows),
        caption=f"encoder: amplitude of the eccentricity {amplitude:.3f} +- {amplitude_sd:.2g} deg (1 sigma),"
        f" phase {phase}; joint: by the data together with the priors of other parameters",
    )


def move_table(name: str, fit: HeadFit) -> Table:
    """Table of the moves with their residuals."""
    spots = fit.spots
    standoffs = [spots.placements[n].standoff_mm for n in spots.placement.tolist()]
    rows = zip(
        standoffs,
        spots.reading_deg.tolist(),
        *spots.position_px.T.tolist(),
        *fit.residual_px.T.tolist(),
        *fit.residual_sd_px.T.tolist(),
        strict=True,
    )
    return Table(
        name=f"{name}-moves",
        title="Moves of the head",
        columns=(
            Column(key="standoff_mm", name="standoff", unit="mm"),
            Column(key="reading_deg", name="reading", unit="deg"),
            Column(key="u_px", name="u", unit="px", format=".3f"),
            Column(key="v_px", name="v", unit="px", format=".3f"),
            Column(key="u_residual_px", name="residual u", unit="px", format="+.3f"),
            Column(key="v_residual_px", name="residual v", unit="px", format="+.3f"),
            Column(key="u_sd_px", name="sd u", unit="px", format=".3f"),
            Column(key="v_sd_px", name="sd v", unit="px", format=".3f"),
        ),
        rows=tuple(rows),
        is_detail=True,
    )


def missing_table(name: str, captures: Sequence[HeadCapture], outliers: Sequence[Rejected]) -> Table:
    """Table of the captures without a usable spot."""
    rejected = [
        (one.reading_deg, one.found.source, one.found.reason)
        for one in captures
        if isinstance(one.found, Rejected)
    ]
    return Table(
        name=f"{name}-missing",
        title="Captures without a usable spot",
        columns=(
            Column(key="reading_deg", name="reading", unit="deg"),
            Column(key="capture", name="capture"),
            Column(key="cause", name="cause"),
        ),
        rows=(*rejected, *((None, one.source, one.reason) for one in outliers)),
        is_detail=True,
    )


def residual_charts(name: str, fit: HeadFit) -> list[Chart]:
    """Chart of the residuals along the line over the reading, one series for each standoff."""
    spots = fit.spots
    series = []
    for number, placement in enumerate(spots.placements):
        own = np.flatnonzero(spots.placement == number)
        own = own[np.argsort(spots.reading_deg[own])]
        series.append(
            Series(
                name=f"{placement.standoff_mm:g} mm",
                x=tuple(spots.reading_deg[own].tolist()),
                y=tuple(fit.residual_px[own, 0].tolist()),
                sd=tuple(fit.residual_sd_px[own, 0].tolist()),
            )
        )
    return [
        Chart(
            name=f"{name}-residuals",
            title="Residuals of the head's spots",
            x=Axis(label="reading of the encoder", unit="deg"),
            y=Axis(label="measured - predicted, u", unit="px"),
            series=tuple(series),
        )
    ]
