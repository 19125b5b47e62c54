"""`workbench compare`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.calibration.verdict.tables import difference_table
from workbench.model.calibration import Calibration, load_calibration
from workbench.report.terminal_table import TerminalTable


def compare_calibrations(a: Path, b: Path, as_json: bool) -> None:
    """Compare two calibrations: JSON on standard output, a table and the verdict on standard error.

    Raises:
        BadInputError: a file is wrong, or the calibrations have no parameter in common.
    """
    of_a, of_b = load_calibration(a), load_calibration(b)
    result = compare(of_a, of_b)
    if as_json:
        print(json.dumps(asdict(result)))
    console = Console(stderr=True, markup=False)
    console.print(TerminalTable(difference_table(result.differences)))
    console.print(verdict(result), highlight=False)
    for note in _notes(of_a, of_b, result.identical):
        console.print(f"note: {note}", highlight=False)


def _notes(a: Calibration, b: Calibration, identical: bool) -> list[str]:
    """Reservations about the verdict."""
    notes = []
    of_a, of_b = a.laser_ranger, b.laser_ranger
    same_captures = of_a.provenance.captures_sha256 == of_b.provenance.captures_sha256
    if same_captures and not identical:
        notes.append(
            "both calibrations use the same captures; the test assumes independent ones and is too lenient"
        )
    notes += [
        f"{name} failed its limits and was accepted because: {c.fit.accepted_because or 'no reason given'}"
        for name, c in (("A", of_a), ("B", of_b))
        if c.fit.verdict == "refused"
    ]
    return notes


def verdict(result: Comparison) -> str:
    """Verdict in words."""
    if result.identical:
        return "identical: both files contain the same numbers to the last digit"
    evidence = (
        f"chi2 {result.chi2:.1f} for {result.degrees_of_freedom} degrees of freedom,"
        f" p = {result.probability:.2g}"
    )
    if not result.moved:
        return f"same within uncertainty ({evidence})"
    if not result.explanations:
        return f"moved ({evidence}); no single parameter explains it"
    return f"moved ({evidence}); explained by {' or '.join(result.explanations)} alone"
