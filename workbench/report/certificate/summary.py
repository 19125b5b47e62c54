"""First page: verdict and five numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from workbench.model import event as ev
from workbench.model.calibration import Calibration
from workbench.model.number_text import counted, two_digits
from workbench.report.certificate.range_uncertainty import RangeUncertainty
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import KeyNumber, Verdict

DASH = "-"
KEY_RANGE_MM = 1000.0
"""Range at which the first page states the uncertainty."""


def verdict_of(session: SessionRecord, calibration: Calibration | None) -> Verdict:
    """Verdict on the session: its calibration, its limits, its trials."""
    failed = [one for one in session.events(ev.LimitChecked) if one.verdict == "fail"]
    reasons = [f"{one.step}, {one.of}: {one.quantity} expected {one.limit}" for one in failed[:4]]
    if len(failed) > len(reasons):
        reasons.append(f"{len(failed) - len(reasons)} more limits failed")
    reasons += _trial_outcomes(session)
    fit = session.fit
    if fit is not None and fit.verdict == "refused" and calibration is None:
        return Verdict("bad", "Calibration refused", (*fit.reasons, *reasons))
    if session.status.state != "finished":
        why = session.status.why or session.status.state
        return Verdict("bad" if failed else "open", f"Session {session.status.state}: {why}", tuple(reasons))
    if calibration is None:
        return Verdict("open", "No calibration in this session", tuple(reasons))
    return _of_calibration(session, calibration, bool(failed), reasons)


def _of_calibration(
    session: SessionRecord, calibration: Calibration, failed: bool, reasons: Sequence[str]
) -> Verdict:
    ours = calibration.laser_ranger.fit
    because = f"accepted in spite of failed limits because: {ours.accepted_because}"
    if ours.verdict == "refused":
        text = "Calibration accepted with a reason, although limits failed"
        return Verdict("open", text, (because, *ours.reasons, *reasons))
    if failed:
        return Verdict("bad", "A limit failed", tuple(reasons))
    text = "Calibration accepted" if session.is_own_calibration else "Measured with an accepted calibration"
    return Verdict("good", text, tuple(reasons))


def _trial_outcomes(session: SessionRecord) -> Iterator[str]:
    trials = {one.trial for one in session.events(ev.TrialFinished)}
    for step in session.events(ev.StepFinished):
        if (name := f"{step.procedure}.{step.index}") in trials:
            yield f"{name}: {step.outcome}"


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
    expanded_mm = 2.0 * (one.mean_sd_mm or 0.0)
    name = "U at 1 m" if one.range_mm == KEY_RANGE_MM else f"U at {one.range_mm:g} mm"
    return KeyNumber(name, f"{two_digits(expanded_mm)} mm", "k = 2, a single range, mean of the lasers")


def _largest(found: Sequence[RangeUncertainty]) -> KeyNumber:
    inside = [(2.0 * one.mean_sd_mm / one.range_mm, one) for one in found if one.inside and one.mean_sd_mm]
    if not inside:
        return KeyNumber("Largest U", DASH, "not known")
    relative, one = max(inside, key=lambda pair: pair[0])
    return KeyNumber(
        "Largest U", f"{two_digits(100 * relative)} %", f"k = 2, of the range, at {one.range_mm:g} mm"
    )


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
