"""Tables of the accuracy trial."""

from __future__ import annotations

import pytest

from tests.support.accuracy_runs import COMPLETE, STANDOFFS_MM, accuracy_run, incomplete_run
from tests.support.rangers import IDS, thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.model.table_layout import blocks, text_columns
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.ranges import CLOSEST, MEAN
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.accuracy.tables import COLUMNS, SOURCES, accuracy_table, detail_tables, verdict_table
from workbench.trials.accuracy.verdict import verdict_of

LIMITS = AccuracyLimits.model_validate({"mean_relative_error": {"in": [-0.5, 0.5]}})
RANGES = accuracy_run(SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1))


def test_every_statistic_is_a_column_with_its_unit() -> None:
    assert {column.key for column in COLUMNS} == {*AccuracyRow.__dataclass_fields__, "mean_relative_error"}
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)
    table = accuracy_table("p.1", [AccuracyRow(500.0, 3, 1, 0.5, 0.9, -0.1, 0.2, 0.3, 0.4)])
    assert table.name == "p.1"
    assert table.rows == ((500.0, 3, 1, 0.5, 0.9, -0.1, 0.2, 0.3, 0.4, 0.001),)


def test_the_verdict_has_one_row_for_each_range_and_fits_80_columns() -> None:
    table = verdict_table("p.1", RANGES, verdict_of(RANGES, LIMITS, COMPLETE), LIMITS, COMPLETE)
    rows = table.records()
    assert [row["range"] for row in rows] == [CLOSEST, MEAN, *IDS]
    assert [row["decision"] for row in rows] == ["-", "pass", *["-"] * 4]
    assert len(blocks(text_columns(table), 80)) == 1
    without = AccuracyLimits()
    free = verdict_table("p.1", RANGES, verdict_of(RANGES, without, COMPLETE), without, COMPLETE)
    assert "decision" not in {column.key for column in free.columns}


def test_a_laser_without_any_spot_is_a_row_of_the_verdict() -> None:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1)
    ranges, done = incomplete_run(bench, count=2, dead=["L3"])
    limits = AccuracyLimits.model_validate({"laser_relative_error": {"in": [-0.5, 0.5]}})
    rows = verdict_table("p.1", ranges, verdict_of(ranges, limits, done), limits, done).records()
    (dead,) = [row for row in rows if row["range"] == "L3"]
    assert (dead["readings"], dead["missing"], dead["error_mm"]) == (0, 2 * len(STANDOFFS_MM), None)
    assert dead["decision"] == "fail"


def test_details_are_left_to_the_files() -> None:
    tables = detail_tables("p.1", RANGES)
    assert [table.name for table in tables] == ["p.1-bias", "p.1-budget", "p.1-linearity"]
    assert all(table.is_detail for table in tables)
    bias, budget, linear = (table.records() for table in tables)
    assert len(bias) == sum(len(one.placements) for one in RANGES)
    assert [row["range"] for row in linear] == [CLOSEST, MEAN, *IDS]
    notes = [row["note"] for row in budget if row["range"] == MEAN]
    assert notes == [""] * len(STANDOFFS_MM) + ["all standoffs", "repeats"]
    first = RANGES[0].uncertainty[0]
    assert (bias[0]["u_mm"], bias[0]["expanded_mm"]) == pytest.approx((first.u, first.k * first.u))
    of_sources = [row for row in budget if row["note"] == ""]
    assert all(isinstance(row[key], float) for row in of_sources for key in SOURCES)
    assert {row["alarm"] for row in of_sources} == {None}
    assert all(isinstance(row["alarm"], bool) for row in budget if row["note"])
