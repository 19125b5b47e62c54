"""Tables of a fit: parameters, cross-validation and the evidence on terms of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from workbench.model.calibration import TERM_VERDICTS, Parameters, TermSummary
from workbench.model.fit_event import CrossValidatedPlacement, FitFinished, ParameterRecord
from workbench.model.table import Column, Table

DETERMINED_BY = "joint: by the data together with the priors of other parameters"


_PARAMETER_COLUMNS = (
    Column(key="name", name="parameter"),
    Column(key="value", name="value", format="digits of sd"),
    Column(key="sd", name="sd", format="sd"),
    Column(key="unit", name="unit"),
    Column(key="prior_value", name="prior", format="g"),
    Column(key="prior_sd", name="prior sd", format=".3g"),
    Column(key="data_share", name="information share", unit="%", scale=100, format=".0f"),
    Column(key="determined_by", name="determined by"),
)


def parameter_table(parameters: Sequence[ParameterRecord]) -> Table:
    """Fitted parameters with their priors, 1 sigma; the caption lists the fixed ones."""
    fitted = [p for p in parameters if p.prior_sd > 0]
    fixed = ", ".join(f"{p.name} {p.value:g}" for p in parameters if p.prior_sd == 0)
    return Table(
        name="parameters",
        title="Parameters (sd: 1 sigma)",
        columns=_PARAMETER_COLUMNS,
        rows=tuple(
            (p.name, p.value, p.sd, p.unit, p.prior_value, p.prior_sd, p.data_share, p.determined_by)
            for p in fitted
        ),
        caption=f"{DETERMINED_BY}. Fixed: {fixed}" if fixed else DETERMINED_BY,
    )


def calibration_parameter_table(parameters: Parameters) -> Table:
    """Parameters of a calibration file, 1 sigma; it contains no values of the priors."""
    p = parameters
    each = zip(p.names, p.values, p.sd, p.units, p.prior_sd, p.data_share, p.determined_by, strict=True)
    return Table(
        name="parameters",
        title="Parameters (sd: 1 sigma)",
        columns=tuple(column for column in _PARAMETER_COLUMNS if column.key != "prior_value"),
        rows=tuple(row for row in each if row[4] > 0),
        caption=DETERMINED_BY,
    )


def cross_validation_table(placements: Sequence[CrossValidatedPlacement]) -> Table:
    """Error of each placement, ranged by the fit without it, against its stated uncertainty."""
    ids = list(dict.fromkeys(laser.laser_id for one in placements for laser in one.lasers))
    return Table(
        name="cross_validation",
        title="Cross-validation: each placement ranged by the fit without it",
        columns=(
            Column(key="standoff_mm", name="standoff", unit="mm", format="g"),
            Column(key="error_mm", name="error", unit="mm", format="+.2f"),
            Column(key="sd_mm", name="stated u", unit="mm", format="sd"),
            Column(key="normalised_error", name="error / u", format="+.1f"),
            Column(key="alarm", name="alarm"),
            Column(key="alarm_test", name="found by"),
            *(Column(key=f"relative_error.{i}", name=i, unit="%", scale=100, format="+.2f") for i in ids),
        ),
        rows=tuple(_placement_row(one, ids) for one in placements),
        caption=(
            "error: range - standoff, empty where the spots give no finite range; u: 1 sigma at the standoff;"
            " error / u: from the linearised model, so it can differ from the quotient of the two columns;"
            " %: relative error of each laser alone; !: the placement contradicts the others, found by its"
            " range error (range) or by the distance of all its spots from their predictions (spots)"
        ),
    )


def worst_placements_table(fit: FitFinished, captures: Mapping[str, str], most: int) -> Table:
    """Placements that agree least with the others, the least probable first.

    Args:
        fit: the fit.
        captures: numbers of the captures by key of placement, as text.
        most: largest number of rows.
    """
    ordered = sorted(fit.left_out, key=lambda one: min(one.range_p, one.spots_p))
    return Table(
        name="worst_placements",
        title="Worst placements, ranged by the fit without them",
        columns=(
            Column(key="standoff_mm", name="standoff", unit="mm", format="g"),
            Column(key="error_mm", name="error", unit="mm", format="+.2f"),
            Column(key="sd_mm", name="stated u", unit="mm", format="sd"),
            Column(key="normalised_error", name="error / u", format="+.1f"),
            Column(key="p", name="p", format=".1g"),
            Column(key="alarm", name="alarm"),
            Column(key="captures", name="captures"),
        ),
        rows=tuple(
            (
                one.standoff_mm,
                one.error_mm,
                one.sd_mm,
                one.z,
                min(one.range_p, one.spots_p),
                one.alarm,
                captures.get(one.placement, ""),
            )
            for one in ordered[:most]
        ),
    )


def _placement_row(one: CrossValidatedPlacement, ids: Sequence[str]) -> tuple[str | float | bool | None, ...]:
    relative = {
        laser.laser_id: laser.error_mm / one.standoff_mm for laser in one.lasers if laser.error_mm is not None
    }
    tested = (one.standoff_mm, one.error_mm, one.sd_mm, one.z, one.alarm, one.alarm_test)
    return (*tested, *(relative.get(i) for i in ids))


def term_table(terms: Sequence[TermSummary]) -> Table:
    """Evidence on each term of the model against its absence."""
    return Table(
        name="terms",
        title="Model terms, each against its absence",
        columns=(
            Column(key="name", name="term"),
            Column(key="p_value", name="p", format=".2g"),
            Column(key="log10_bayes_factor", name="log10 Bayes factor", format="+.1f"),
            Column(key="range_shift_sd", name="range shift", unit="sd", format=".2g"),
            Column(key="verdict", name="verdict"),
        ),
        rows=tuple(map(_term_row, terms)),
        caption=(
            "p: probability of such data without the term; Bayes factor: for the term; range shift: largest"
            " change of a range without it"
        ),
    )


def _term_row(term: TermSummary) -> tuple[str | float | None, ...]:
    shift, verdict = term.range_shift_sd, TERM_VERDICTS[term.verdict]
    return (term.name, term.p_value, term.log10_bayes_factor, shift, verdict)


def fit_tables(fit: FitFinished) -> tuple[Table, ...]:
    """All tables of a fit that have rows: parameters, terms, cross-validation."""
    tables = (parameter_table(fit.parameters), term_table(fit.terms), cross_validation_table(fit.left_out))
    return tuple(table for table in tables if table.rows)
