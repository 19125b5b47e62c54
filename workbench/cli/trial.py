"""`workbench trial`: statistics of readings of any range sensor."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from workbench.cli.console import result_console
from workbench.model.errors import BadInputError
from workbench.model.table import Cell
from workbench.report.terminal_table import TerminalTable
from workbench.trials.any_sensor.analysis import Analysis, analyse
from workbench.trials.any_sensor.readings_file import load_sessions

OPERATORS = "gauge-rr"
"""Kind of trial in which the column `session` names an operator, not a session."""

SHORTEST_MM = 10.0
"""True ranges that all lie below this may be metres: triangulating heads begin at some 10 mm, and most
sensors in a laboratory end at 10 m."""


def analyse_readings(kind: str, paths: Sequence[Path], as_json: bool) -> None:
    """Analyse files of readings; print table and notes (`result_console`), with `as_json` the result too.

    Raises:
        BadInputError: a file is wrong, or there are several for a gauge R&R study.
    """
    if kind == OPERATORS and len(paths) > 1:
        raise BadInputError(
            f"{kind}: expected one file, whose column `session` names the operators, got {len(paths)} files"
        )
    result = analyse(kind, load_sessions(paths))
    if as_json:
        print(json.dumps(_plain(result)))
    console = result_console(as_json)
    console.print(TerminalTable(result.table))
    for note in _notes(result):
        console.print(f"note: {note}", highlight=False)


def _plain(result: Analysis) -> dict[str, object]:
    """Analysis as plain numbers and texts; `rows` has the keys of the table's columns."""
    rows: list[dict[str, Cell]] = result.table.records()
    return {
        "kind": result.kind,
        "readings": result.readings,
        "missing": result.missing,
        "autocorrelation": asdict(result.autocorrelation),
        "clipped": [asdict(level) for level in result.clipped],
        "rows": rows,
        "caption": result.table.caption,
    }


def _notes(result: Analysis) -> list[str]:
    """Reservations about the table."""
    notes = [
        f"{level.clipped} of {level.readings} readings at {level.standoff_mm:g} mm are clipped at"
        f" {level.limit_mm:g} mm, the end of the sensor's scale; this true range is left out"
        for level in result.clipped
    ]
    if result.missing:
        notes.append(f"{result.missing} of {result.readings + result.missing} readings have no range")
    if result.autocorrelation.lag1 > 0:
        notes.append(f"successive readings are autocorrelated (lag 1: {result.autocorrelation.lag1:.2f})")
    if result.longest_mm < SHORTEST_MM:
        notes.append(
            f"all true ranges are below {SHORTEST_MM:g} mm (the longest: {result.longest_mm:g} mm); state"
            " true_mm and measured_mm in millimetres, not in metres"
        )
    return notes
