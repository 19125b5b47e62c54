"""Verdict on a calibration: the lasers against each other, then all errors of a verification together.

The tests share a probability of 5 % to refuse a valid calibration (Bonferroni's inequality). They are the
most powerful one for each change of the sensor, and one for any other error. A focal length that has changed
is the hardest to see, because ruler and baselines move the ranges likewise: it has the largest share.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from workbench.model.number_text import probability
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.verify.changes import FOCAL_LENGTH, REFOCUSED, Change, changes, named
from workbench.trials.verify.laser_errors import laser_errors
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import PlacementCheck

LASERS_ALARM = 0.005
"""Probability that the lasers of a valid calibration are taken to disagree, before a target is measured."""
ALARM = 0.045
"""Probability that a valid calibration is refused by the ranges; the following parts share it."""
CHANGE_ALARMS = {FOCAL_LENGTH: 0.02, REFOCUSED: 0.01}
OTHER_CHANGES_ALARM = 0.01
"""Of all other changes together."""
ANY_ERROR_ALARM = 0.005
"""Of the chi-square of all errors."""
MEASURE_AGAIN = "measure the target's standoffs again; if they are right, calibrate again"


@dataclass(frozen=True)
class Verdict:
    """Verdict on a calibration, with the action that follows."""

    valid: bool
    text: str
    action: str
    changes: tuple[Change, ...] = ()
    """Changes of the sensor that explain the errors, each alone, best supported first."""


def lasers_verdict(check: PlacementCheck) -> Verdict:
    """Verdict on the lasers against each other at a placement whose distance need not be known."""
    if check.range_mm is None:
        return Verdict(False, "no laser was ranged", "check the lasers, their exposure and the target")
    if check.missing:
        return _without_range([check])
    if check.lasers_p is None:
        return Verdict(True, "too few lasers to compare them with one another", "measure the target")
    if check.lasers_p >= LASERS_ALARM:
        return Verdict(True, "the lasers agree", "measure the target")
    return Verdict(
        False,
        f"the lasers disagree on a flat target ({probability(check.lasers_p)})",
        "check that the target is flat and that no laser or lens is loose; then calibrate again",
    )


def ranges_verdict(
    sensor: CalibratedSensor,
    reference: Reference,
    checks: Sequence[PlacementCheck],
    unmeasured: Sequence[PlacementCheck] = (),
) -> Verdict:
    """Verdict on the ranges of all lasers at all placements.

    Args:
        sensor: the calibrated sensor.
        reference: ruler and rail.
        checks: placements with measured standoffs.
        unmeasured: others, whose large uncertainty leaves the agreement of their lasers.
    """
    errors = laser_errors(reference, [*unmeasured, *checks])
    if errors is None or not any(one.readings for one in checks):
        return Verdict(False, "no range at any standoff", "check the target and the exposure; verify again")
    if any(one.missing for one in checks):
        return _without_range(checks)
    found = changes(sensor, errors)
    p = _joint_p(found, errors.probability)
    if p >= ALARM:
        return Verdict(True, f"the ranges agree ({probability(p)})", "keep the calibration")
    text = f"the ranges disagree with the target ({probability(p)})"
    return explained(Verdict(False, text, MEASURE_AGAIN), found)


def _without_range(checks: Sequence[PlacementCheck]) -> Verdict:
    where = "; ".join(f"{', '.join(one.missing)} at {one.standoff_mm:g} mm" for one in checks if one.missing)
    return Verdict(
        False,
        f"lasers without a range, whose spots must be in the picture: {where}",
        "check that these lasers light the target, and their exposure; if they do, they are turned: calibrate"
        " again",
    )


def explained(verdict: Verdict, found: Iterable[Change]) -> Verdict:
    """Verdict with the changes of the sensor that the errors suggest."""
    suggested = tuple(found)
    if not (text := named(suggested)):
        return verdict
    return Verdict(verdict.valid, f"{verdict.text}; {text}", verdict.action, suggested)


def _joint_p(found: Sequence[Change], any_error_p: float) -> float:
    """P value of all tests together: each counts by its share of `ALARM`."""
    others = max(sum(one.parameters not in CHANGE_ALARMS for one in found), 1)
    weighted = [one.p / CHANGE_ALARMS.get(one.parameters, OTHER_CHANGES_ALARM / others) for one in found]
    return min(1.0, ALARM * min(*weighted, any_error_p / ANY_ERROR_ALARM, 1.0 / ALARM))
