"""`python -m tests.proofs.validation`: how often the checks of a fit cry wolf, and how often they see one.

Sound calibrations by `tests.support.rigs.World` (truth, placement errors, tilts, speckle and noise drawn from
the rig's tolerances), and the same with one standoff 10 mm off.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.support.rigs import STANDOFFS_MM, World, thesis_rig
from tests.support.stored_output import store
from workbench.calibration.checks import cross_validation, residuals
from workbench.calibration.checks.faults import find_faults
from workbench.calibration.selection.outliers import fit_without_outliers

FIRST_SEED = 20_000
MISTAKE_MM = 10.0


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fits", type=int, default=2000)
    parser.add_argument("--mistakes", type=int, default=20, help="fits for each standoff that is off")
    arguments = parser.parse_args()
    lines = [*_sound(arguments.fits), *_mistaken(arguments.mistakes)]
    store(
        "validation", "Checks of a fit", f"python -m tests.proofs.validation --fits {arguments.fits}", lines
    )


def _sound(fits: int) -> Iterator[str]:
    found: Counter[str] = Counter()
    chances: dict[str, list[float]] = {}
    for number in range(fits):
        fit = fit_without_outliers(thesis_rig(), World(thesis_rig(), FIRST_SEED + number).observations())
        folds, tests = cross_validation.leave_each_out(fit), residuals.residual_tests(fit)
        found["cross-validation alarm"] += bool(cross_validation.alarms(folds))
        found["residual test alarm"] += bool(residuals.alarms(tests))
        found["fault named"] += bool(find_faults(fit, folds))
        found["spot rejected"] += bool(fit.rejected)
        found["noise scaled"] += fit.noise_scale > 1
        for fold in folds:
            chances.setdefault("cross-validation: range", []).append(fold.range_p)
            chances.setdefault("cross-validation: spots", []).append(fold.spots_p)
        for test in tests:
            chances.setdefault(test.name, []).append(test.p)
        if sys.stderr.isatty() and number % 100 == 99:
            print(number + 1, file=sys.stderr)
    yield f"{fits} sound calibrations (4 lasers, 11 standoffs, 5 repeats); fits with a"
    stated = {
        "cross-validation alarm": "at most 0.1 %",
        "residual test alarm": "at most 1 %",
        "fault named": "none",
        "spot rejected": "at most 0.1 %",
        "noise scaled": "1 %",
    }
    for name, words in stated.items():
        share, sd = found[name] / fits, max(found[name], 1) ** 0.5 / fits
        yield f"  {name:<24} {found[name]:5d}   {100 * share:6.2f} +- {100 * sd:.2f} %   stated: {words}"
    yield f"{'chances below':<28}{'0.5':>8}{'0.1':>8}{'0.01':>8}{'tests':>8}"
    for name, values in chances.items():
        shares = "".join(f"{(np.array(values) < level).mean():8.3f}" for level in (0.5, 0.1, 0.01))
        yield f"{name:<28}{shares}{len(values):8d}"


def _mistaken(fits: int) -> Iterator[str]:
    yield f"one standoff {MISTAKE_MM:g} mm off, {fits} calibrations each: alarm at it, named as a standoff"
    for standoff_mm in STANDOFFS_MM:
        alarmed = named = 0
        for number in range(fits):
            seen = World(thesis_rig(), FIRST_SEED + number).observations()
            off = standoff_mm + MISTAKE_MM
            told = [replace(s, standoff_mm=off) if s.standoff_mm == standoff_mm else s for s in seen]
            fit = fit_without_outliers(thesis_rig(), told)
            folds = cross_validation.leave_each_out(fit)
            alarmed += off in {fold.standoff_mm for fold in cross_validation.alarms(folds)}
            names = [f for f in find_faults(fit, folds) if f.name == "standoff"]
            named += len(names) == 1 and f"captures at {off:g} mm" in names[0].message
        yield f"  {standoff_mm:6g} mm   {100 * alarmed / fits:5.0f} %   {100 * named / fits:5.0f} %"


if __name__ == "__main__":
    main()
