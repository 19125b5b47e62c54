"""Tables of a verification: verdict, errors by the calibration and by another one, possible changes."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

from workbench.model.calibration import Calibration, CrossValidatedRange
from workbench.model.table import Cell, Column, Table
from workbench.model.trial_event import NOT_VALID
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.reading_frame import table_of
from workbench.trials.verify.changes import Change
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import PlacementCheck, predicted_mm
from workbench.trials.verify.verdict import Verdict

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="error_mm", name="observed error", unit="mm", format="+.2f"),
    Column(key="expanded_mm", name="predicted U", unit="mm", format=".2f"),
    Column(key="outside", name="outside"),
    Column(key="lasers_p", name="lasers agree, p", format=".2g"),
    Column(key="cross_validated_mm", name="cross-val. error", unit="mm", format="+.2f"),
    Column(key="cross_validated_at_mm", name="at", unit="mm"),
)
OTHER = (
    Column(key="other_error_mm", name="other's error", unit="mm", format="+.2f"),
    Column(key="other_expanded_mm", name="other's U", unit="mm", format=".2f"),
)
CAPTION = (
    "predicted U: expanded uncertainty (k = 2) by calibration, spots, standoff, ruler and tilt; cross-val.:"
    " error of the calibration's placement nearest to this range, by the fit without it"
)
MOST_CHANGES = 5
Measured = tuple[Reference, Sequence[PlacementCheck]]
"""Ruler and rail of a calibration's verification, and the placements by that calibration."""


def verify_tables(
    name: str,
    sensor: CalibratedSensor,
    measured: Measured,
    verdict: Verdict,
    other: Measured | None = None,
) -> list[Table]:
    """Verdict with its action, and table of predicted, observed and cross-validated errors.

    Args:
        name: name of the step.
        sensor: sensor of the calibration.
        measured: ruler and rail, and the measured placements.
        verdict: verdict on the calibration.
        other: the same placements by another calibration.
    """
    rows = [_row(sensor, measured[0], check) for check in measured[1]]
    if other is not None:
        for row, check in zip(rows, other[1], strict=True):
            row["other_error_mm"] = check.error_mm(other[0])
            row["other_expanded_mm"] = predicted_mm(other[0], check) if check.readings else None
    columns = (*COLUMNS, *OTHER) if other is not None else COLUMNS
    return [
        Table(
            name=f"{name}-verdict",
            title="Verdict",
            columns=(
                Column(key="valid", name="valid"),
                Column(key="verdict", name="verdict"),
                Column(key="action", name="action"),
            ),
            rows=(("yes" if verdict.valid else NOT_VALID, verdict.text, verdict.action),),
        ),
        table_of(name, "Verification: error = measured - true", columns, rows, CAPTION),
    ]


def change_table(name: str, found: Sequence[Change]) -> Table:
    """Table of the changes that explain the errors best, each alone."""
    rows: list[dict[str, Cell]] = [
        {
            "change": one.name,
            "amount": one.amount,
            "sd": one.sd,
            "unit": one.unit,
            "gain": one.gain,
            "remaining_p": one.remaining_p,
        }
        for one in found[:MOST_CHANGES]
    ]
    return table_of(
        f"{name}-changes",
        "Changes of the sensor that explain the errors, each alone",
        (
            Column(key="change", name="change"),
            Column(key="amount", name="amount", format="digits of sd"),
            Column(key="sd", name="sd", format="sd"),
            Column(key="unit", name="unit"),
            Column(key="gain", name="gain", format=".1f"),
            Column(key="remaining_p", name="p of the rest", format=".2g"),
        ),
        rows,
        "gain: reduction of chi-square; changes whose gains differ by less than 6 cannot be distinguished",
    )


def nearest_cross_validation(calibration: Calibration, standoff_mm: float) -> CrossValidatedRange | None:
    """Placement of the calibration nearest in ratio to a range; None in files without cross-validation."""
    placements = calibration.laser_ranger.fit.cross_validation
    return min(placements, key=lambda one: abs(log(one.standoff_mm / standoff_mm)), default=None)


def _row(sensor: CalibratedSensor, reference: Reference, check: PlacementCheck) -> dict[str, Cell]:
    row: dict[str, Cell] = {"standoff_mm": check.standoff_mm, "readings": check.readings}
    if (nearest := nearest_cross_validation(sensor.calibration, check.standoff_mm)) is not None:
        row |= {"cross_validated_mm": nearest.error_mm, "cross_validated_at_mm": nearest.standoff_mm}
    error_mm = check.error_mm(reference)
    if error_mm is None:
        return row
    expanded_mm = predicted_mm(reference, check)
    return row | {
        "error_mm": error_mm,
        "expanded_mm": expanded_mm,
        "outside": abs(error_mm) > expanded_mm,
        "lasers_p": check.lasers_p,
    }
