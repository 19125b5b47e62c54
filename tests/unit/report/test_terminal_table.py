"""Tables on the terminal: nothing cut, nothing wrapped that is a number."""

from __future__ import annotations

import re

import pytest
from rich.console import Console

from tests.viewer.session import a_fit
from workbench.calibration.design.forecast import RANGES_MM, RangeForecast
from workbench.calibration.design.tables import range_forecast_table
from workbench.calibration.verdict.comparison import Difference
from workbench.calibration.verdict.tables import difference_table
from workbench.cli.plan import plan_table
from workbench.model.fit_event import CrossValidatedPlacement, LaserError
from workbench.model.fit_tables import cross_validation_table, fit_tables
from workbench.model.table import Column, Table
from workbench.procedure.engine.durations import StepDurations
from workbench.procedure.engine.plan import PlannedStep
from workbench.report.terminal_table import TerminalTable

EIGHT = [f"H{i}" for i in range(1, 5)] + [f"V{i}" for i in range(1, 5)]
RANGES = range_forecast_table(EIGHT, [RangeForecast(i, r, 0.1234, 0.0567) for r in RANGES_MM for i in EIGHT])
DIFFERENCES = difference_table([Difference(i, r, -12.34, 56.78) for r in RANGES_MM for i in EIGHT])
LEFT_OUT = CrossValidatedPlacement(
    placement="p1",
    standoff_mm=1250.0,
    error_mm=-12.5,
    sd_mm=0.55,
    lasers=tuple(LaserError(laser_id=i, error_mm=12.5, sd_mm=1.0) for i in EIGHT),
    alarm=True,
)
PLAN = plan_table(
    [PlannedStep("calibrate-flat", 2, "Capture at 11 standoffs, 10 pairs a laser", 11, 440)], StepDurations()
)


def lines(table: Table, width: int = 80) -> list[str]:
    console = Console(width=width, color_system=None)
    with console.capture() as captured:
        console.print(TerminalTable(table))
    return captured.get().splitlines()


def words(table: Table) -> set[str]:
    """Everything that the table says, word by word."""
    texts = [table.title, table.caption, *(column.heading for column in table.columns)]
    texts += [table.text(row, i) for row in range(len(table.rows)) for i in range(len(table.columns))]
    return {word for text in texts for word in text.split()}


@pytest.mark.parametrize(
    "table",
    [*fit_tables(a_fit()), RANGES, DIFFERENCES, cross_validation_table([LEFT_OUT] * 3), PLAN],
    ids=lambda table: table.name,
)
@pytest.mark.parametrize("width", [80, 120])
def test_every_table_fits_and_nothing_is_cut(table: Table, width: int) -> None:
    printed = lines(table, width)
    assert max(map(len, printed)) <= width
    assert words(table) <= {word for line in printed for word in line.split()}


@pytest.mark.parametrize("table", [RANGES, DIFFERENCES], ids=lambda table: table.name)
def test_a_wide_table_is_printed_in_blocks_with_the_first_column_in_each(table: Table) -> None:
    printed = [line.split() for line in lines(table)]
    rows = [line for line in printed if line[:1] == ["1000"]]
    assert [len(row) for row in rows] == [9, 9], "two columns for each of eight lasers, and the range"


def test_title_comes_first_and_caption_last() -> None:
    table = Table(
        name="t", title="The title", columns=(Column(key="a", name="a"),), rows=((1,),), caption="The end"
    )
    printed = [line.strip() for line in lines(table) if line.strip()]
    assert (printed[0], printed[-1]) == ("The title", "The end")


def test_numbers_are_aligned_to_the_right_and_names_with_brackets_stay() -> None:
    table = Table(
        name="t",
        title="T",
        columns=(
            Column(key="a", name="[bold]name[/]"),
            Column(key="b", name="value", unit="mm", format=".1f"),
        ),
        rows=(("[red]x", 1.25), ("y", 1000.0), ("z", None)),
    )
    printed = lines(table)
    assert "[bold]name[/]" in "".join(printed)
    rows = [line.rstrip() for line in printed if re.match(r"(\[red\]x|y|z) ", line)]
    assert [row.split()[-1] for row in rows] == ["1.2", "1000.0", "-"]
    assert len({len(row) for row in rows}) == 1


def test_words_are_folded_where_there_is_no_room() -> None:
    table = Table(
        name="t",
        title="T",
        columns=(Column(key="a", name="step"), Column(key="b", name="title"), Column(key="c", name="n")),
        rows=(("calibrate-flat.1", "a long title " * 8, 12345),),
    )
    printed = lines(table, 50)
    assert max(map(len, printed)) <= 50
    assert sum(line.count("long") for line in printed) == 8
    assert "12345" in "".join(printed)
