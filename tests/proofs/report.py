"""The proofs' tables, and which of their figures are missed."""

from __future__ import annotations

import numpy as np

from tests.proofs import joint, simulate
from tests.proofs.score import HEADER, Score, score
from tests.proofs.study import HELD_MM, RANGES_MM, Outcome
from workbench.calibration.verdict.assessment import PRIOR_UNMOVED
from workbench.model.rig import Rig

BANDS = ((125.0, 2000.0, 0.5, 2.5), (2000.0, 4500.0, 1.0, 3.5))
"""Nearest and farthest standoff in mm; mean absolute error in %: the most that it may be, the thesis's."""


def tables(rig: Rig, outcome: Outcome, fitted_by: str) -> tuple[list[str], list[str]]:
    """All lines, the misses at their end, and the misses by themselves."""
    parameters, undetermined = parameter_scores(rig, outcome)
    by_range = range_scores(rig, outcome)
    accuracy, missed_accuracy = _accuracy(rig, outcome)
    together, missed_joint = joint.lines(outcome.joint_p)
    misses = [miss for s in (*parameters, *by_range) for miss in s.misses] + missed_joint + missed_accuracy
    if unsolved := int(outcome.unsolved.sum()):
        misses.append(f"{unsolved} fits did not converge")
    lines = [
        *_about(rig, outcome, fitted_by),
        "",
        "Every parameter that the data determine, alone or jointly",
        HEADER,
        *(s.line() for s in parameters),
        f"not determined, their priors stand: {', '.join(undetermined) or 'none'}",
        *together,
        "",
        "Range in mm of a target that the calibration has not seen, by one spot of one laser",
        HEADER,
        *(s.line() for s in by_range),
        "",
        *accuracy,
        "",
        *(f"MISSED  {miss}" for miss in misses),
        *([] if misses else ["Every figure is reached."]),
    ]
    return lines, misses


def parameter_scores(rig: Rig, outcome: Outcome) -> tuple[list[Score], list[str]]:
    """Scores of what most calibrations determine, and the names of what they do not."""
    scores, undetermined = [], []
    for i, (name, prior) in enumerate(zip(simulate.names(rig), simulate.priors(rig), strict=True)):
        sd = outcome.parameter_sd[:, i]
        if prior.sd and np.median(sd) > PRIOR_UNMOVED * prior.sd:
            undetermined.append(name)
        elif prior.sd:
            scores.append(score(name, outcome.parameter[:, i], sd, outcome.parameter_bound[:, i]))
    return scores, undetermined


def range_scores(rig: Rig, outcome: Outcome) -> list[Score]:
    """Scores of every laser at every range."""
    return [
        score(
            f"{laser} {r:g}", outcome.range[:, k, i], outcome.range_sd[:, k, i], outcome.range_bound[:, k, i]
        )
        for k, r in enumerate(RANGES_MM)
        for i, laser in enumerate(rig.laser_ids)
    ]


def _about(rig: Rig, outcome: Outcome, fitted_by: str) -> list[str]:
    n = len(outcome.parameter)
    return [
        f"{n} sensors drawn from the tolerances of {rig.rig}, calibrated at the standoffs of",
        "calibrate-flat.yaml with placement errors, tilts, speckle and noise (OpenCV's lens, not ours),",
        f"{fitted_by}.",
        "Coverage: of the stated 95 % interval, 93 - 97 % expected.",
        "rms / bound: root mean square error over the Bayesian Cramér-Rao bound, at most 1.05 expected.",
        "+-: 1 sigma, from the number of calibrations.",
        f"Spots out of the frame, or beyond the fold of a drawn lens: {100 * outcome.missing.mean():.2f} %.",
        f"Fits that enlarged their noise: {100 * outcome.noise_scaled.mean():.2f} % (1 % by chance);"
        f" not converged: {int(outcome.unsolved.sum())}.",
    ]


def _accuracy(rig: Rig, outcome: Outcome) -> tuple[list[str], list[str]]:
    """Mean absolute relative errors, a line a standoff and a band."""
    lines = [
        "Mean absolute range error in % at standoffs that no calibration has seen",
        f"{'mm':>10}{'together':>10}" + "".join(f"{laser:>9}" for laser in rig.laser_ids),
    ]
    flat = 100 * np.abs(outcome.held_flat) / HELD_MM
    single = 100 * np.abs(outcome.held) / HELD_MM[:, None]
    by_flat, by_laser = np.nanmean(flat, axis=0), np.nanmean(single, axis=0)
    for standoff, of_flat, of_lasers in zip(HELD_MM, by_flat, by_laser, strict=True):
        lines.append(f"{standoff:>10g}{of_flat:>10.3f}" + "".join(f"{x:>9.3f}" for x in of_lasers))
    misses = []
    for low, high, limit, thesis in BANDS:
        inside = (low <= HELD_MM) & (high >= HELD_MM)
        worst, spots = float(by_flat[inside].max()), float(by_laser[inside].mean())
        lines.append(
            f"{low:g} - {high:g} mm: together, the worst standoff {worst:.3f} %; single spots, mean of all"
            f" {spots:.3f} %; expected at most {limit:g} % (the thesis: {thesis:g} %)"
        )
        for what, figure in (("all lasers together, worst standoff", worst), ("single spots", spots)):
            if not figure <= limit:
                misses.append(f"{low:g} - {high:g} mm, {what}: {figure:.3f} %, expected at most {limit:g} %")
    return lines, misses
