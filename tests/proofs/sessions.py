"""`python -m tests.proofs.sessions`: whole sessions on the virtual bench, from its light to the file.

`make prove` begins with the places of spots. Here frames are rendered, exposures searched, spots found,
grouped, fitted and exported as `workbench run procedures/calibrate-flat.yaml` does it, each session on a
bench with another truth. The files are held against the truths. Twenty minutes; the table goes to
docs/benchmarks.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from scipy.stats import binom, chi2, kstest, norm

from tests.crash.short import CALLER
from tests.proofs import simulate
from tests.proofs.score import NORMAL_95
from tests.proofs.study import RANGES_MM
from tests.support.stored_output import store
from tests.support.virtual_truth import parameter_values
from workbench.calibration.verdict.assessment import PRIOR_UNMOVED
from workbench.model.arrays import FloatArray
from workbench.model.calibration import load_calibration
from workbench.model.errors import WorkbenchError
from workbench.model.rig import Rig, load_rig
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs" / "thesis-emulated.yaml"
PROCEDURE = ROOT / "procedures" / "calibrate-flat.yaml"
FIRST_SEED, SESSIONS = 40_000, 100
RARE = 1e-3
"""Chance at which a figure is told as missed, for each line of the table."""


ENDED_EARLY = 0.01
"""Of the sessions: the checks that a fit has to pass refuse a sound one now and then (docs/validation.md)."""
FEWEST = 20
"""Sessions that a line of the table is made of at least."""


@dataclass(frozen=True)
class Outcome:
    """An exported calibration against the bench that it was made on."""

    parameter_z: FloatArray
    """(S,) error over stated deviation; NaN where the data do not determine the parameter."""
    range_z: FloatArray
    """(K, L) at RANGES_MM, of the calibration alone: the spots are where the truth has them. NaN where the
    spot is out of the picture."""
    relative: FloatArray
    """(K, L) error of the range."""
    distance: float
    """Squared distance of all free parameters from the truth, by their covariance."""
    free: int
    """How many those are."""


def session(seed: int, folder: Path) -> Outcome | str:
    """Run one; where it ended before its export, why."""
    text = RIG.read_text()
    assert text.count("  seed: 2001\n") == 1
    rig_file = folder / "rig.yaml"
    rig_file.write_text(text.replace("  seed: 2001\n", f"  seed: {seed}\n"))
    try:
        run(Plan.load(rig_file, [PROCEDURE]), folder / "s", [], CALLER, lambda: None)
    except WorkbenchError as error:
        return str(error)
    return outcome(load_rig(rig_file), folder / "s" / "calibration.yaml", folder / "s.truth.yaml")


def outcome(rig: Rig, calibration_file: Path, truth_file: Path) -> Outcome:
    """Hold a calibration against the truth of its bench."""
    sensor = CalibratedSensor(load_calibration(calibration_file))
    stated = sensor.calibration.laser_ranger.parameters
    assert list(stated.names) == simulate.names(rig)
    truth = _truth(rig, truth_file)
    error, covariance = np.array(stated.values) - truth, stated.covariance_array
    sd = np.sqrt(np.diag(covariance))
    determined = (sd > 0) & (sd <= PRIOR_UNMOVED * np.array(stated.prior_sd))
    z0 = (RANGES_MM + truth[simulate.lens_size(rig)])[None]
    seen = simulate.spots(rig, truth[None], z0, np.zeros((*z0.shape, 2)))[0]
    seen[~simulate.in_frame(rig, seen)] = np.nan
    found, range_sd = _ranged(sensor, seen)
    free = sd > 0
    z = error / np.where(free, sd, 1.0)
    scaled = covariance[np.ix_(free, free)] / np.outer(sd[free], sd[free])
    return Outcome(
        parameter_z=np.where(determined, z, np.nan),
        range_z=(found - RANGES_MM[:, None]) / range_sd,
        relative=found / RANGES_MM[:, None] - 1.0,
        distance=float(z[free] @ np.linalg.solve(scaled, z[free])),
        free=int(free.sum()),
    )


def table(sessions: int) -> Iterator[str]:
    """Run so many; the lines, misses last."""
    rig = load_rig(RIG)
    outcomes: list[Outcome] = []
    ended_early: list[str] = []
    for seed in range(FIRST_SEED, FIRST_SEED + sessions):
        with tempfile.TemporaryDirectory() as folder:
            ended = session(seed, Path(folder))
        if isinstance(ended, Outcome):
            outcomes.append(ended)
        else:
            ended_early.append(f"seed {seed}: {ended}")
        print(seed, ended if isinstance(ended, str) else "exported", file=sys.stderr, flush=True)
    yield f"{sessions} sessions, seeds from {FIRST_SEED} on; without a calibration: {len(ended_early)}"
    yield from ended_early
    misses = []
    if len(ended_early) > (most := binom.ppf(1 - RARE, sessions, ENDED_EARLY)):
        misses.append(f"{len(ended_early)} sessions without a calibration, expected at most {most:.0f}")
    if outcomes:
        lines, more = scores(rig, outcomes)
        yield from lines
        misses += more
    else:
        misses.append("no session exported a calibration")
    yield from (f"MISSED  {miss}" for miss in misses)
    if not misses:
        yield f"No line is off by more than happens once in {1 / RARE:.0f}."


def scores(rig: Rig, outcomes: Sequence[Outcome]) -> tuple[list[str], list[str]]:
    """The table of what was exported, and which of its figures are missed."""
    misses: list[str] = []
    told = [f"{'':>14}{'n':>6}{'coverage %':>12}{'rms z':>9}{'mean z':>9}"]
    parameters = np.array([o.parameter_z for o in outcomes])
    ranges = np.array([o.range_z for o in outcomes])
    lines = [(name, parameters[:, i]) for i, name in enumerate(simulate.names(rig))]
    for k, range_mm in enumerate(RANGES_MM):
        lines += [(f"{laser} {range_mm:g}", ranges[:, k, n]) for n, laser in enumerate(rig.laser_ids)]
    for name, column in lines:
        z = column[np.isfinite(column)]
        if z.size < FEWEST:
            continue
        inside = int((np.abs(z) <= NORMAL_95).sum())
        rms, mean = float(np.sqrt((z**2).mean())), float(z.mean())
        told.append(f"{name:>14}{z.size:>6}{100 * inside / z.size:>12.1f}{rms:>9.3f}{mean:>+9.3f}")
        misses += [f"{name}: {what}" for what in _misses(z, inside)]
    chances = np.array([float(chi2.sf(o.distance, o.free)) for o in outcomes])
    even = float(kstest(chances, "uniform").pvalue)
    below = ", ".join(f"{level}: {(chances < level).mean():.3f}" for level in (0.5, 0.1, 0.05, 0.01))
    told.append(f"all free parameters together, share of sessions with a chance below {below}")
    told.append(f"chance that these chances are even (Kolmogorov-Smirnov): {even:.3f}")
    if even < RARE:
        misses.append(f"all parameters together: chances not even, p {even:.1e}")
    relative = 100 * np.abs(np.array([o.relative for o in outcomes]))
    by_range = [f"{range_mm:g} mm {np.nanmean(relative[:, k]):.2f}" for k, range_mm in enumerate(RANGES_MM)]
    told.append(f"mean absolute error of the range by the calibration alone, %: {', '.join(by_range)}")
    return told, misses


def _misses(z: FloatArray, inside: int) -> Iterator[str]:
    """What is too far from a normal distribution to be chance."""
    low, high = binom.ppf(RARE / 2, z.size, 0.95), binom.ppf(1 - RARE / 2, z.size, 0.95)
    if not low <= inside <= high:
        yield f"{inside} of {z.size} within the 95 % interval, expected {low:.0f} to {high:.0f}"
    low, high = np.sqrt(chi2.ppf([RARE / 2, 1 - RARE / 2], z.size) / z.size)
    if not low <= (rms := np.sqrt((z**2).mean())) <= high:
        yield f"rms z {rms:.3f}, expected {low:.3f} to {high:.3f}"
    if not abs(mean := z.mean()) <= (most := norm.isf(RARE / 2) / np.sqrt(z.size)):
        yield f"mean z {mean:+.3f}, expected within {most:.3f} of 0"


def _ranged(sensor: CalibratedSensor, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ranges (K, L) of spots (K, L, 2) and what the calibration adds to their deviations, mm."""
    found, sd = np.full(seen.shape[:2], np.nan), np.full(seen.shape[:2], np.nan)
    for n, laser in enumerate(sensor.ids):
        there = np.isfinite(seen[:, n]).all(axis=-1)
        ranged = sensor.ranges([laser] * int(there.sum()), seen[there, n], np.full((there.sum(), 2), np.nan))
        found[there, n] = ranged.range_mm
        gradient = ranged.by_parameter
        sd[there, n] = np.sqrt(np.einsum("kp,pq,kq->k", gradient, sensor.covariance, gradient))
    return found, sd


def _truth(rig: Rig, path: Path) -> FloatArray:
    """(S,) in the order of `simulate.names`."""
    values = parameter_values(YAML(typ="safe").load(path))
    return np.array([values[name] for name in simulate.names(rig)])


def main() -> int:
    """Run, print, keep; 1 where a line is off."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=SESSIONS)
    lines = list(table(parser.parse_args().sessions))
    store("sessions", "Sessions from light to file", "python -m tests.proofs.sessions", lines)
    return int(any(line.startswith("MISSED") for line in lines))


if __name__ == "__main__":
    sys.exit(main())
