"""Sections on what was found: calibration, range uncertainty, cross-validation, trials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import fmean

from workbench.model import event as ev
from workbench.model.calibration import Calibration
from workbench.model.chart import Axis, Band, Chart, Series
from workbench.model.fit_charts import residual_chart
from workbench.model.fit_event import CrossValidatedPlacement
from workbench.model.fit_tables import (
    calibration_parameter_table,
    cross_validation_table,
    parameter_table,
    term_table,
)
from workbench.model.rig import ImageAxis
from workbench.model.table import Column, Table
from workbench.report.certificate.coverage import is_recorded
from workbench.report.certificate.range_uncertainty import (
    MOST_LASERS,
    RangeUncertainty,
    curve_mm,
    range_uncertainties,
    uncertainty_chart,
    uncertainty_table,
)
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import Fact, Section

MOST_POINTS = 1500
"""Largest number of residuals that are drawn one by one."""
COVERAGE = (
    "Expanded uncertainties U are standard uncertainties u times a coverage factor k for a coverage"
    " probability of about 95 %, as in the GUM (JCGM 100): 95.45 %, k = 2 for a normal distribution. Where"
    " the calibration estimated its noise from few data, k is that of Student's distribution with the"
    " effective degrees of freedom nu (Welch and Satterthwaite). Where a trial's table has its own k or"
    " states 95 %, the probability is 95 % exactly. sd and u are one standard deviation."
)
NOT_RECORDED = (
    "The version that made the calibration did not record the degrees of freedom of its noise: k = 2 is used."
)
LINEARITY = (
    "Linearity: independent deviations are from the straight line that makes the largest one smallest (best"
    " fit), absolute ones from the line of identity, measured = true. A line through the end points is not"
    " used. Percent are of full scale, the largest minus the smallest true range of the trial."
)
INPUTS = (
    "The uncertainty contains noise and speckle of the spots, placement and tilt of the target, scale of the"
    " ruler, and the parameters that rest on the rig file's priors, with their full covariance. Temperature"
    " effects, drift after the calibration, and other target materials are not part of this uncertainty."
)


def calibration_section(session: SessionRecord, calibration: Calibration | None) -> Section:
    """Parameters, what determined them, and null directions in words."""
    fit = session.fit
    if fit is None and calibration is None:
        return Section("calibration", "Calibration", texts=("The session has no calibration.",))
    tables: list[Table] = []
    texts: list[str] = []
    if fit is not None:
        tables += [parameter_table(fit.parameters), term_table(fit.terms)]
        texts += fit.warnings
        texts += [f"Fault: {fault.message}" for fault in fit.faults]
    elif calibration is not None:
        tables.append(calibration_parameter_table(calibration.laser_ranger.parameters))
        texts += calibration.laser_ranger.fit.warnings
    facts = _calibration_facts(session, calibration)
    if not texts:
        texts.append("The data determine every combination of the parameters better than their priors.")
    shown = tuple(table for table in tables if table.rows)
    return Section("calibration", "Calibration", facts, tuple(texts), shown)


def uncertainty_section(calibration: Calibration | None, found: Sequence[RangeUncertainty]) -> Section:
    """Range uncertainty over 0.1 to 5 m."""
    key, title = "range_uncertainty", "Range uncertainty"
    if calibration is None:
        return Section(key, title, texts=("There is no calibration: the range uncertainty is not known.",))
    curve = uncertainty_chart(range_uncertainties(calibration, curve_mm(calibration)))
    remark = () if is_recorded(calibration.laser_ranger.fit) else (NOT_RECORDED,)
    return Section(
        key, title, texts=(COVERAGE, *remark, INPUTS), tables=(uncertainty_table(found),), charts=(curve,)
    )


def validation_section(fit: ev.FitFinished | None) -> Section:
    """Residuals and cross-validation."""
    key, title = "validation", "Residuals and cross-validation"
    if fit is None:
        return Section(key, title, texts=("The session has no fit of its own.",))
    axes: tuple[ImageAxis, ImageAxis] = ("u", "v")
    charts = [chart for axis in axes if not (chart := _residual_chart(fit, axis)).is_empty]
    ordered = sorted(fit.left_out, key=lambda one: one.standoff_mm)
    tables = [cross_validation_table(_without_many_lasers(ordered)), _test_table(fit)]
    if fit.left_out:
        charts.append(_cross_validation_chart(ordered))
    text = "Each placement is ranged by a fit without it. Bars and u are one standard deviation."
    return Section(key, title, texts=(text,), tables=tuple(t for t in tables if t.rows), charts=tuple(charts))


def trial_sections(session: SessionRecord) -> tuple[Section, ...]:
    """Tables and charts of each finished trial, with its outcome."""
    titles = {f"{one.procedure}.{one.index}": one.title for one in session.events(ev.StepStarted)}
    outcomes = {f"{one.procedure}.{one.index}": one.outcome for one in session.events(ev.StepFinished)}
    readings = session.events(ev.ReadingTaken)
    sections = []
    for trial in session.events(ev.TrialFinished):
        own = [one for one in readings if one.trial == trial.trial]
        missing = sum(one.range_mm is None for one in own)
        facts = (
            Fact("Outcome", outcomes.get(trial.trial, session.unfinished_text)),
            *((Fact("Verdict", found.text),) if (found := trial.verification) is not None else ()),
            Fact("Readings", f"{len(own)}, {missing} of them without a range"),
        )
        linear = any(table.name.endswith("-linearity") for table in trial.tables)
        title = f"Trial {trial.trial}: {titles.get(trial.trial, '')}".rstrip(": ")
        charts = tuple(chart for chart in trial.charts if not chart.is_empty)
        tables = tuple(table for table in trial.tables if table.rows)
        sections.append(
            Section(f"trial-{trial.trial}", title, facts, (LINEARITY,) if linear else (), tables, charts)
        )
    return tuple(sections)


def _calibration_facts(session: SessionRecord, calibration: Calibration | None) -> tuple[Fact, ...]:
    facts: list[Fact] = []
    fit = session.fit
    if fit is not None:
        used = f"{fit.rms_px:.3f} px over {fit.observations} spots, {len(fit.rejected)} rejected"
        facts += [Fact("Verdict of the fit", fit.verdict), Fact("Rms residual", used)]
    for loaded in session.events(ev.CalibrationLoaded):
        facts.append(Fact("Existing calibration", loaded.text))
    if calibration is not None:
        ours = calibration.laser_ranger
        nearest, farthest = ours.validity.standoff_mm
        facts += [
            Fact(
                "Made",
                f"{ours.provenance.created} by {ours.provenance.operator}, session {ours.provenance.session}",
            ),
            Fact("Validity", f"{nearest:g} to {farthest:g} mm from the reference plane"),
            Fact(
                "Largest relative standard uncertainty",
                f"{100 * ours.validity.max_relative_range_sd:.2g} % of a single range, any laser",
            ),
        ]
        if ours.fit.accepted_because:
            facts.append(Fact("Accepted in spite of failed limits because", ours.fit.accepted_because))
    return tuple(facts)


def _residual_chart(fit: ev.FitFinished, axis: ImageAxis) -> Chart:
    """Residuals of each laser; of many lasers, or with many points, their mean and span at each standoff."""
    lasers = {one.laser_id for one in fit.residuals}
    if len(lasers) <= MOST_LASERS and len(fit.residuals) <= MOST_POINTS:
        return residual_chart(fit, axis)
    by_standoff: dict[float, list[float]] = {}
    for one in fit.residuals:
        if (value := one.u_px if axis == "u" else one.v_px) is not None:
            by_standoff.setdefault(one.standoff_mm, []).append(value)
    at = tuple(sorted(by_standoff))
    return Chart(
        name=f"residuals_{axis}",
        title=f"Residuals along {axis} of {len(lasers)} lasers",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label=f"residual {axis}", unit="px"),
        series=(Series(name="mean", x=at, y=tuple(fmean(by_standoff[mm]) for mm in at), style="line"),),
        bands=(
            Band(
                name="lowest to highest",
                x=at,
                low=tuple(min(by_standoff[mm]) for mm in at),
                high=tuple(max(by_standoff[mm]) for mm in at),
            ),
        ),
    )


def _without_many_lasers(placements: Sequence[CrossValidatedPlacement]) -> Sequence[CrossValidatedPlacement]:
    """Placements without the errors of single lasers, where those need more columns than a page has."""
    if all(len(one.lasers) <= MOST_LASERS for one in placements):
        return placements
    return [one.model_copy(update={"lasers": ()}) for one in placements]


def _test_table(fit: ev.FitFinished) -> Table:
    return Table(
        name="residual_tests",
        title="Tests of the residuals",
        columns=(Column(key="name", name="pattern"), Column(key="p", name="p", format=".2g")),
        rows=tuple((one.name, one.p) for one in fit.residual_tests),
        caption="p: probability of such a pattern by chance, with the stated noise",
    )


def _cross_validation_chart(placements: Sequence[CrossValidatedPlacement]) -> Chart:
    """Errors of placements in ascending order of their standoff."""
    sd = tuple(100.0 * one.sd_mm / one.standoff_mm for one in placements)
    return Chart(
        name="cross_validation",
        title="Cross-validation: error of a placement ranged by the fit without it",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label="error / standoff", unit="%"),
        series=(
            Series(
                name="all lasers",
                x=tuple(one.standoff_mm for one in placements),
                y=tuple(
                    math.nan if one.error_mm is None else 100.0 * one.error_mm / one.standoff_mm
                    for one in placements
                ),
                sd=sd,
                expected_sd=sd,
            ),
        ),
        flagged_x=tuple(dict.fromkeys(one.standoff_mm for one in placements if one.alarm)),
    )
