"""Calibrations of a scanning head by simulation: `python -m tests.proofs.scanning`, part of `make prove`.

Each head is drawn from the priors of the rig file, with the virtual bench's own geometry. It is calibrated
as by procedures/scan-calibrate.yaml, then it scans flats at standoffs that the calibration has not. The exit
code is 1 where a coverage contradicts 93 to 97 %.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.proofs.figure import Figure
from tests.support.rigs import PROVENANCE
from tests.support.scanned_head import SimulatedHead
from tests.support.stored_output import store
from workbench.calibration.scanning.export import calibrated_head, eccentricity_deg
from workbench.calibration.scanning.fit import fit_head
from workbench.calibration.scanning.prediction import head_table
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig
from workbench.model.target import CylinderTarget, Placement
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.sensor.scanning import CalibratedHead, ScanPoints
from workbench.trials.scanning.calibrate_step import CalibrateHeadStep
from workbench.trials.scanning.surface import SHARED, deviations

ROOT = Path(__file__).parents[2]
HEADS = 400
BOUNDS = (0.93, 0.97)
SPOT_SD_PX = 0.05
"""Noise of a mean spot, with speckle."""
SCANNED_MM = (300.0, 600.0, 1500.0)
SCANNED = {
    "x": "x of points",
    "range": "range of points",
    "deviation from a flat": "deviation from a flat",
}
"""Quantities of a point at one angle, and of all points."""
CYLINDER_MM = 500.0
CYLINDER = CylinderTarget(diameter_mm=178.0, diameter_sd_mm=0.5)
CYLINDER_DEG = (-19.0, -17.0, -15.0, -13.0, -11.0, -9.0, -7.0, -5.0, -3.0, -1.0)
"""From one limb to the other."""
SCANNED_DEG = (-33.0, -27.0, -21.0, -15.0, -9.0, -3.0, 3.0, 9.0, 15.0)


@dataclass(frozen=True)
class Outcome:
    """Errors of n calibrated heads in stated standard deviations."""

    parameter: FloatArray
    """(n, S); NaN for constants."""
    point: FloatArray
    """(n, standoffs, angles, 3) x and range of scanned points, and their deviation from the stated flat; NaN
    outside the image."""
    cylinder: FloatArray
    """(n, angles) deviations of scanned points from the stated cylinder; NaN where the beam misses it."""
    range_sd: FloatArray
    """(n, standoffs, angles) stated relative standard deviation of a range."""
    noise_scaled: int
    """Number of fits whose noise was scaled."""
    phases: int
    """Number of fits that state a phase of the eccentricity."""


def run(rig: Rig, heads: int, seed: int, known: Rig | None = None) -> Outcome:
    """Draw heads from the priors of `rig` and calibrate each, by the rig `known` if it differs."""
    procedure = load_procedure(ROOT / "procedures/scan-calibrate.yaml")
    step = next(one for one in procedure.steps if isinstance(one, CalibrateHeadStep))
    parameter, point, cylinder, range_sd, scaled, phases = [], [], [], [], 0, 0
    for number in range(heads):
        random = np.random.default_rng([seed, number])
        head = SimulatedHead.of(rig, 100_000 * seed + number)
        fit = fit_head(known or rig, head.spots(step.standoffs_mm, step.angles_deg, SPOT_SD_PX, random))
        size = len(head.values)
        sd = np.where(fit.sd[:size] > 0, fit.sd[:size], np.nan)
        parameter.append((fit.values[:size] - head.values) / sd)
        sensor = CalibratedHead(calibrated_head(fit, PROVENANCE))
        z, relative = _scan(head, sensor, random)
        point.append(z)
        cylinder.append(_scan_cylinder(head, sensor, random))
        range_sd.append(relative)
        scaled += fit.noise_scale > 1
        phases += eccentricity_deg(fit)[2] is not None
    return Outcome(
        np.array(parameter), np.array(point), np.array(cylinder), np.array(range_sd), scaled, phases
    )


def _scan(
    head: SimulatedHead, sensor: CalibratedHead, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Errors of scanned points (standoffs, angles, 3) in their deviations; relative sd of ranges."""
    readings = np.array(SCANNED_DEG)
    errors, relative = [], []
    for standoff_mm in SCANNED_MM:
        key = f"scan-{standoff_mm:g}"
        plane = head.plane(key, standoff_mm)
        true = np.array([head.point(key, plane, reading) for reading in SCANNED_DEG])
        position, inside = head.seen(true, SPOT_SD_PX, random)
        found = sensor.points(readings, position, np.full_like(position, SPOT_SD_PX))
        true[:, 2] -= head.truth.offset_mm
        z = (found.position_mm - true) / found.sd_mm
        z[:, 1] = _deviation_z(head, sensor, Placement(key=key, standoff_mm=standoff_mm), found)
        errors.append(np.where(inside[:, None], z[:, [0, 2, 1]], np.nan))
        relative.append(np.where(inside, found.sd_mm[:, 2] / true[:, 2], np.nan))
    return np.array(errors), np.array(relative)


def _scan_cylinder(head: SimulatedHead, sensor: CalibratedHead, random: np.random.Generator) -> FloatArray:
    """Deviations of scanned points (angles,) from the stated cylinder, in their stated deviations."""
    placed = Placement(key="cylinder", standoff_mm=CYLINDER_MM, target=CYLINDER)
    surface = head.cylinder(placed.key, placed.standoff_mm, CYLINDER, random)
    true = np.array([head.point(placed.key, surface, reading) for reading in CYLINDER_DEG])
    position, inside = head.seen(true, SPOT_SD_PX, random)
    points = sensor.points(np.array(CYLINDER_DEG), position, np.full_like(position, SPOT_SD_PX))
    return np.where(inside, _deviation_z(head, sensor, placed, points), np.nan)


def _deviation_z(
    head: SimulatedHead, sensor: CalibratedHead, placed: Placement, points: ScanPoints
) -> FloatArray:
    found = deviations(placed, head.rig.bench, points.position_mm)
    return np.asarray(found.mm / found.sd_mm(points, sensor.covariance_with(SHARED)))


def figures(rig: Rig, outcome: Outcome) -> list[Figure]:
    """Coverage of the 95 % intervals of every parameter and of scanned points, and of all together."""
    names = [parameter.name for parameter in head_table(rig, ()).parameters]
    free = np.asarray(np.isfinite(outcome.parameter).all(axis=0))
    found = [
        Figure("parameter", name, _coverage(outcome.parameter[:, n]), BOUNDS, len(outcome.parameter))
        for n, name in enumerate(names)
        if free[n]
    ]
    for n, standoff_mm in enumerate(SCANNED_MM):
        for k, what in enumerate(SCANNED):
            for m, reading in enumerate(SCANNED_DEG):
                z = outcome.point[:, n, m, k]
                if np.isfinite(z).sum() > len(z) / 2:
                    quantity = f"{what} at {standoff_mm:g} mm, {reading:g} deg"
                    found.append(Figure("scan", quantity, _coverage(z), BOUNDS, int(np.isfinite(z).sum())))
    for m, reading in enumerate(CYLINDER_DEG):
        z = outcome.cylinder[:, m]
        if np.isfinite(z).sum() > len(z) / 2:
            quantity = f"deviation from a cylinder, {reading:g} deg"
            found.append(Figure("scan", quantity, _coverage(z), BOUNDS, int(np.isfinite(z).sum())))
    count = len(outcome.parameter)
    found.append(Figure("together", "parameters", _coverage(outcome.parameter[:, free]), BOUNDS, count))
    for k, what in enumerate(SCANNED.values()):
        found.append(Figure("together", what, _coverage(outcome.point[..., k]), BOUNDS, count))
    found.append(Figure("together", "deviation from a cylinder", _coverage(outcome.cylinder), BOUNDS, count))
    return found


def blind_figures(rig: Rig, outcome: Outcome) -> list[Figure]:
    """Coverage where the fit knows no eccentricity; information, not a claim."""
    names = [parameter.name for parameter in head_table(rig, ()).parameters]
    zero = outcome.parameter[:, names.index(f"{rig.scanning_head.laser}.tx")]
    shown = {
        "zero of the encoder": zero,
        "x of points": outcome.point[..., 0],
        "range of points": outcome.point[..., 1],
    }
    return [
        Figure("blind", f"{what}, no eccentricity fitted", _coverage(z), None, len(zero))
        for what, z in shown.items()
    ]


def _coverage(z: FloatArray) -> float:
    seen = z[np.isfinite(z)]
    return float((np.abs(seen) < COVERAGE_FACTOR).mean())


def without_eccentricity(rig: Rig) -> Rig:
    """The rig file with an encoder that has no eccentricity."""
    head = rig.scanning_head.model_copy(update={"eccentricity_sd_deg": 0.0})
    return rig.model_copy(update={"head": head})


def main() -> int:
    """Simulate, print and store the figures; 1 if one contradicts its bounds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--heads", type=int, default=HEADS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rig = load_rig(ROOT / "rigs/scanning-head-emulated.yaml")
    outcome = run(rig, given.heads, given.seed)
    found = figures(rig, outcome)
    ignored = run(rig, given.heads // 4, given.seed, without_eccentricity(rig))
    ranges = [
        f"{100 * np.nanmedian(outcome.range_sd[:, n]):.2f} % at {mm:g} mm" for n, mm in enumerate(SCANNED_MM)
    ]
    lines = [
        f"{given.heads} heads; coverage of 95 % intervals",
        *(one.line() for one in found),
        "",
        f"median sd of a range: {', '.join(ranges)}",
        f"fits with scaled noise: {outcome.noise_scaled}; fits that state a phase: {outcome.phases}",
        "fitted as if the encoder had no eccentricity:",
        *(one.line() for one in blind_figures(rig, ignored)),
    ]
    command = f"python -m tests.proofs.scanning --heads {given.heads} --seed {given.seed}"
    store("scanning", "Calibrations of a scanning head", command, ["", *lines, ""])
    missed = [one for one in found if one.is_missed]
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
