"""Tables of the accuracy trial: the verdict, the thesis's statistics, and the details of bias and budget."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.table import Cell, Column, Table
from workbench.trials.accuracy.agreement import Agreement, budget_of
from workbench.trials.accuracy.completeness import Completeness
from workbench.trials.accuracy.joint_tests import JointTest, joint_tests
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.accuracy.verdict import Verdict, range_decision
from workbench.trials.reading_frame import table_of

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="missing", name="missing"),
    Column(key="mean_error_mm", name="mean error", unit="mm", format="+.2f"),
    Column(key="max_error_mm", name="max", unit="mm", format="+.2f"),
    Column(key="min_error_mm", name="min", unit="mm", format="+.2f"),
    Column(key="sd_mm", name="sd", unit="mm", format=".2f"),
    Column(key="range_sd_mm", name="stated u", unit="mm", format=".2f"),
    Column(key="reference_sd_mm", name="reference u", unit="mm", format=".2f"),
    Column(key="mean_relative_error", name="mean error", unit="%", scale=100, format="+.2f"),
)
VERDICT = (
    Column(key="range", name="range"),
    Column(key="readings", name="n"),
    Column(key="missing", name="missing"),
    Column(key="error_mm", name="worst error", unit="mm", format="+.3g"),
    Column(key="expanded_mm", name="U", unit="mm", format="sd"),
    Column(key="at_mm", name="at", unit="mm", format=".0f"),
    Column(key="en", name="E_n", format=".2f"),
    Column(key="p", name="p", format=".2g"),
    Column(key="coverage", name="inside", unit="%", scale=100, format=".0f"),
    Column(key="coverage_low", name="low", unit="%", scale=100, format=".0f"),
)
DECISION = Column(key="decision", name="decision")
BIAS = (
    Column(key="range", name="range"),
    Column(key="standoff_mm", name="true", unit="mm", format=".1f"),
    Column(key="readings", name="n"),
    Column(key="error_mm", name="mean error", unit="mm", format="+.3g"),
    Column(key="u_mm", name="u", unit="mm", format="sd"),
    Column(key="expanded_mm", name="U", unit="mm", format="sd"),
    Column(key="k", name="k", format=".2f"),
    Column(key="z", name="z", format="+.2f"),
    Column(key="en", name="E_n", format=".2f"),
)
SOURCES = (
    "noise_mm",
    "speckle_mm",
    "calibration_mm",
    "placement_mm",
    "shape_mm",
    "common_tilt_mm",
    "scale_mm",
)
BUDGET = (
    Column(key="range", name="range"),
    Column(key="standoff_mm", name="true", unit="mm", format=".1f"),
    Column(key="error_mm", name="error", unit="mm", format="+.3g"),
    *(
        Column(key=key, name=key.removesuffix("_mm").replace("_", " "), unit="mm", format="sd")
        for key in SOURCES
    ),
    Column(key="explained_mm", name="explained u", unit="mm", format="sd"),
    Column(key="unexplained_mm2", name="unexplained", unit="mm2", format="+sd"),
    Column(key="unexplained_low_mm2", name="low", unit="mm2", format="+sd"),
    Column(key="unexplained_high_mm2", name="high", unit="mm2", format="+sd"),
    Column(key="variance_ratio", name="variance ratio", format=".2f"),
    Column(key="p", name="p", format=".2g"),
    Column(key="alarm", name="alarm"),
    Column(key="note", name="note"),
)
LINEARITY = (
    Column(key="range", name="range"),
    Column(key="independent_mm", name="independent", unit="mm", format=".3g"),
    Column(key="independent_percent", name="independent", unit="% FS", format=".3g"),
    Column(key="absolute_mm", name="absolute", unit="mm", format=".3g"),
    Column(key="absolute_percent", name="absolute", unit="% FS", format=".3g"),
    Column(key="slope", name="slope", format=".5f"),
    Column(key="full_scale_mm", name="full scale", unit="mm"),
)


def accuracy_table(name: str, rows: Sequence[AccuracyRow]) -> Table:
    """Table of the error statistics, one row per standoff."""
    return Table(
        name=name,
        title="Accuracy: error = measured - true",
        columns=COLUMNS,
        rows=tuple(tuple(getattr(row, column.key) for column in COLUMNS) for row in rows),
        caption="a reading is the mean of the lasers; u: standard uncertainty",
    )


def verdict_table(
    name: str, ranges: Sequence[Agreement], verdict: Verdict, limits: AccuracyLimits, done: Completeness
) -> Table:
    """Table of the worst error of each range, with the verdict in its title.

    An expected range that no reading has is a row without an error.
    """
    caption = (
        "worst: largest error / U; U: 95 %; p: all standoffs together; inside: share of readings in their"
        " 95 % interval, low: lower end of its own (Clopper-Pearson, by placement)"
    )
    rows = [_verdict_row(one, limits, done) for one in ranges]
    rows += [_lost_row(one, limits, done) for one in _never_measured(ranges, done)]
    columns = VERDICT if verdict.decision is None else (*VERDICT, DECISION)
    return table_of(f"{name}-verdict", f"Accuracy: {verdict.text}", columns, rows, caption)


def detail_tables(name: str, ranges: Sequence[Agreement]) -> list[Table]:
    """Bias at each standoff, error budget, and linearity of each range."""
    bias = [row for one in ranges for row in _bias_rows(one)]
    tests = joint_tests(ranges)
    budget = [
        row
        for one in ranges
        for row in (*_budget_rows(one), *(_test_row(test) for test in tests if test.name == one.name))
    ]
    linear = [row for one in ranges for row in _linearity_row(one)]
    tables = [
        table_of(f"{name}-bias", "Bias at each standoff", BIAS, bias, "z: mean error / u; E_n: k = 2"),
        table_of(
            f"{name}-budget",
            "Error budget of the mean errors",
            BUDGET,
            budget,
            "unexplained: error^2 - explained u^2, 95 % interval; `repeats`: their scatter; `all standoffs`:"
            " with the full covariance; alarm: p < 5 % / number of these tests",
        ),
        table_of(
            f"{name}-linearity",
            "Linearity",
            LINEARITY,
            linear,
            "largest deviation: independent from the best line, absolute from measured = true",
        ),
    ]
    return [table.model_copy(update={"is_detail": True}) for table in tables if table.rows]


def _verdict_row(one: Agreement, limits: AccuracyLimits, done: Completeness) -> dict[str, Cell]:
    worst, coverage = one.worst, one.coverage
    return {
        "range": one.name,
        "readings": int(one.readings.sum()),
        "missing": one.missing,
        "error_mm": float(one.errors_mm[worst]),
        "expanded_mm": one.uncertainty[worst].expanded,
        "at_mm": float(one.true_mm[worst]),
        "en": one.en[worst],
        "p": one.bias.probability,
        "coverage": coverage.value,
        "coverage_low": coverage.low,
        "decision": range_decision(one.name, one, limits, done) or "-",
    }


def _never_measured(ranges: Sequence[Agreement], done: Completeness) -> list[str]:
    """Names of the expected ranges that no reading of the trial has."""
    measured = {one.name for one in ranges}
    return [name for name in dict.fromkeys(one.name for one in done.lost) if name not in measured]


def _lost_row(name: str, limits: AccuracyLimits, done: Completeness) -> dict[str, Cell]:
    return {
        "range": name,
        "readings": 0,
        "missing": sum(one.readings for one in done.lost_of(name)),
        "decision": range_decision(name, None, limits, done) or "-",
    }


def _bias_rows(one: Agreement) -> list[dict[str, Cell]]:
    return [
        {
            "range": one.name,
            "standoff_mm": float(one.true_mm[n]),
            "readings": int(one.readings[n]),
            "error_mm": float(one.errors_mm[n]),
            "u_mm": one.uncertainty[n].u,
            "expanded_mm": one.uncertainty[n].expanded,
            "k": one.uncertainty[n].k,
            "z": float(one.bias.z[n]),
            "en": one.en[n],
        }
        for n in range(len(one.placements))
    ]


def _budget_rows(one: Agreement) -> list[dict[str, Cell]]:
    rows: list[dict[str, Cell]] = []
    for n, error_mm in enumerate(one.errors_mm.tolist()):
        budget = budget_of(one, n)
        unexplained, low, high = budget.unexplained_mm2
        rows.append(
            {
                "range": one.name,
                "standoff_mm": float(one.true_mm[n]),
                "error_mm": error_mm,
                **budget.sources_mm,
                "explained_mm": budget.explained_mm2**0.5,
                "unexplained_mm2": unexplained,
                "unexplained_low_mm2": low,
                "unexplained_high_mm2": high,
                "note": "",
            }
        )
    return rows


def _test_row(one: JointTest) -> dict[str, Cell]:
    return {
        "range": one.name,
        "variance_ratio": one.ratio,
        "p": one.probability,
        "alarm": one.alarm,
        "note": one.note,
    }


def _linearity_row(one: Agreement) -> list[dict[str, Cell]]:
    if (found := one.linearity) is None:
        return []
    return [
        {
            "range": one.name,
            "independent_mm": found.independent_mm,
            "independent_percent": found.independent_percent,
            "absolute_mm": found.absolute_mm,
            "absolute_percent": found.absolute_percent,
            "slope": found.slope,
            "full_scale_mm": found.full_scale_mm,
        }
    ]
