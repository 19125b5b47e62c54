"""`workbench compare`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.calibration.verdict.tables import difference_table
from workbench.cli.console import result_console
from workbench.model.calibration import load_calibration
from workbench.model.number_text import probability
from workbench.report.terminal_table import TerminalTable


def compare_calibrations(a: Path, b: Path, as_json: bool) -> None:
    """Compare two calibrations: JSON on standard output, a table and the verdict on standard error.

    Raises:
        BadInputError: a file is wrong, or the calibrations have no parameter in common.
    """
    result = compare(load_calibration(a), load_calibration(b))
    if as_json:
        print(json.dumps(asdict(result)))
    console = result_console(as_json)
    console.print(TerminalTable(difference_table(result.differences)))
    console.print(verdict(result), highlight=False)
    for note in result.notes:
        console.print(f"note: {note}", highlight=False)


def verdict(result: Comparison) -> str:
    """Verdict in words."""
    if result.identical:
        return "identical: both files contain the same numbers to the last digit"
    evidence = (
        f"chi2 {result.chi2:.1f} for {result.degrees_of_freedom} degrees of freedom,"
        f" {probability(result.probability)}"
    )
    if not result.moved:
        return f"same within uncertainty ({evidence})"
    if not result.explanations:
        return f"moved ({evidence}); no single parameter explains it"
    return f"moved ({evidence}); explained by {' or '.join(result.explanations)} alone"
