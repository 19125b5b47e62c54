"""Change against the calibration before: the sensor as found and as left."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.model.number_text import probability
from workbench.model.table import Cell, Column, Table
from workbench.report.document import Section
from workbench.trials.errors import EXPANSION

KEY, TITLE = "change", "As found and as left"
EXPLANATION = (
    "As found: a range by the calibration before, of a spot that this calibration sees at the range in"
    " the table. As left: by this calibration, the range itself. The change is what the recalibration"
    " removed."
)


@dataclass(frozen=True)
class Predecessor:
    """The calibration of the same sensor before."""

    name: str
    """Session and file."""
    calibration: Calibration
    sha256: str


def load_predecessor(path: Path) -> Predecessor:
    """Read the calibration before.

    Raises:
        BadInputError: the file is missing or damaged.
    """
    return Predecessor(f"{path.parent.name}/{path.name}", load_calibration(path), file_sha256(path))


def change_section(calibration: Calibration | None, before: Predecessor | None) -> Section:
    """As-found and as-left results: the ranges by the calibration before and by this one."""
    if calibration is None or before is None:
        text = "No earlier calibration of this sensor is known here: its state as found is not stated."
        return Section(KEY, TITLE, texts=(text,))
    try:
        # Spots of the new calibration, ranged by the old one: the sensor as found.
        found = compare(calibration, before.calibration)
    except BadInputError as error:
        text = f"Not comparable with the calibration before ({before.name}): {error}."
        return Section(KEY, TITLE, texts=(text,))
    made = before.calibration.laser_ranger.provenance.created
    return Section(
        KEY,
        TITLE,
        texts=(f"Calibration before: {before.name}, made {made}. {verdict_text(found)}", EXPLANATION),
        tables=(_table(found),),
    )


def verdict_text(found: Comparison) -> str:
    """Whether the sensor changed between two calibrations, in one sentence."""
    if found.identical:
        return "Both have the same numbers."
    evidence = probability(found.probability)
    if not found.moved:
        return f"The sensor has not changed significantly ({evidence})."
    cause = f"; explained by {' or '.join(found.explanations)} alone" if found.explanations else ""
    return f"The sensor has changed ({evidence}{cause})."


def _table(found: Comparison) -> Table:
    ranges = sorted({one.range_mm for one in found.differences})
    return Table(
        name="as_found_as_left",
        title="Error as found, largest and mean over the lasers",
        columns=(
            Column(key="range_mm", name="range as left", unit="mm", format=".0f"),
            Column(key="mean_mm", name="mean error as found", unit="mm", format="+.2f"),
            Column(key="largest_mm", name="largest error as found", unit="mm", format="+.2f"),
            Column(key="laser_id", name="of laser"),
            Column(key="expanded_mm", name="its U (k = 2)", unit="mm", format="sd"),
        ),
        rows=tuple(_row(found, range_mm) for range_mm in ranges),
    )


def _row(found: Comparison, range_mm: float) -> tuple[Cell, ...]:
    own = [one for one in found.differences if one.range_mm == range_mm]
    largest = max(own, key=lambda one: abs(one.difference_mm))
    mean_mm = float(np.mean([one.difference_mm for one in own]))
    return (range_mm, mean_mm, largest.difference_mm, largest.laser_id, EXPANSION * largest.sd_mm)
