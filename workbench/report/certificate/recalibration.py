"""Section on the next calibration: date and reason, if an interval was agreed with the customer."""

from __future__ import annotations

from calendar import monthrange
from datetime import date

from workbench.model.calibration import Calibration
from workbench.model.laboratory import Laboratory
from workbench.report.document import Fact, Section

NOT_AGREED = (
    "No interval is agreed in lab.yaml, and a certificate recommends none without the customer's"
    " agreement (ISO/IEC 17025, 7.8.4.3). Verify the sensor in service (procedures/verify.yaml);"
    " workbench history shows drift and the date at which it would reach the limits."
)


def recalibration_section(lab: Laboratory, calibration: Calibration | None) -> Section:
    """Recommended date of the next calibration, with its reason."""
    key, title = "recalibration", "Next calibration"
    agreed = lab.recalibration
    if calibration is None or agreed is None:
        return Section(key, title, texts=(NOT_AGREED,))
    made = calibration.laser_ranger.provenance.created[:10]
    try:
        due = months_later(date.fromisoformat(made), agreed.months)
    except ValueError:  # a file that another program wrote
        return Section(key, title, texts=(f"The date of the calibration is not readable: {made}.",))
    facts = (
        Fact("Recommended date", f"{due}, {agreed.months} months after the calibration"),
        Fact("Reason", agreed.reason),
    )
    return Section(key, title, facts)


def months_later(day: date, months: int) -> date:
    """The same day some months later, or the last day of that month."""
    year, month = divmod(day.year * 12 + day.month - 1 + months, 12)
    return date(year, month + 1, min(day.day, monthrange(year, month + 1)[1]))
