"""Five numbers of the first page."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model import event as ev
from workbench.model.calibration import Calibration
from workbench.model.number_text import counted, two_digits
from workbench.report.certificate.coverage import k_text
from workbench.report.certificate.range_uncertainty import RangeUncertainty
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import KeyNumber

DASH = "-"
KEY_RANGE_MM = 1000.0
"""Range at which the first page states the uncertainty."""


def key_numbers(
    session: SessionRecord, calibration: Calibration | None, found: Sequence[RangeUncertainty]
) -> tuple[KeyNumber, ...]:
    """The five numbers: span, U at one metre, largest U, rms residual, worst error of a reading's mean."""
    return (
        _span(calibration),
        _at_one_metre(found),
        _largest(found),
        _residual(session),
        _worst_error(session),
    )


def _span(calibration: Calibration | None) -> KeyNumber:
    name = "Calibrated span"
    if calibration is None:
        return KeyNumber(name, DASH, "no calibration")
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    return KeyNumber(name, f"{nearest:g} to {farthest:g} mm", "from the reference plane")


def _at_one_metre(found: Sequence[RangeUncertainty]) -> KeyNumber:
    inside = [one for one in found if one.inside and one.mean_sd_mm is not None]
    if not inside:
        return KeyNumber("U at 1 m", DASH, "not known")
    one = min(inside, key=lambda each: abs(each.range_mm - KEY_RANGE_MM))
    expanded_mm = one.mean_expanded_mm or 0.0
    name = "U at 1 m" if one.range_mm == KEY_RANGE_MM else f"U at {one.range_mm:g} mm"
    note = f"{_k_text(one)}, a single range, mean of the lasers"
    return KeyNumber(name, f"{two_digits(expanded_mm)} mm", note)


def _largest(found: Sequence[RangeUncertainty]) -> KeyNumber:
    inside = [
        (expanded / one.range_mm, one) for one in found if one.inside and (expanded := one.mean_expanded_mm)
    ]
    if not inside:
        return KeyNumber("Largest U", DASH, "not known")
    relative, one = max(inside, key=lambda pair: pair[0])
    return KeyNumber(
        "Largest U",
        f"{two_digits(100 * relative)} %",
        f"{_k_text(one)}, mean of the lasers, at {one.range_mm:g} mm",
    )


def _k_text(one: RangeUncertainty) -> str:
    return k_text(one.mean_k, one.mean_degrees_of_freedom)


def _residual(session: SessionRecord) -> KeyNumber:
    if session.fit is None:
        return KeyNumber("Rms residual", DASH, "no fit in this session")
    spots = counted(session.fit.observations, "spot")
    return KeyNumber(
        "Rms residual", f"{session.fit.rms_px:.3f} px", f"{spots}, {len(session.fit.rejected)} rejected"
    )


def _worst_error(session: SessionRecord) -> KeyNumber:
    """Largest mean error of the readings at one true range, relative to the range."""
    errors: dict[tuple[str, float], list[float]] = {}
    for one in session.events(ev.ReadingTaken):
        if one.error_mm is not None:
            errors.setdefault((one.trial, one.reference_mm), []).append(one.error_mm)
    if not errors:
        return KeyNumber("Largest mean error", DASH, "no trial with readings")
    means = {key: sum(values) / len(values) for key, values in errors.items()}
    (trial, true_mm), mean = max(means.items(), key=lambda item: abs(item[1]) / item[0][1])
    count = counted(len(errors[trial, true_mm]), "reading")
    return KeyNumber(
        "Largest mean error",
        f"{100 * mean / true_mm:+.2f} %",
        f"{mean:+.2f} mm at {true_mm:g} mm, {count}, {trial}",
    )
