"""Layouts of lasers compared: `python -m tests.proofs.layouts`. Field of view, resolution, missed obstacles.

Field of view and rods are those of the rig as designed, by a pinhole and straight beams. The resolution is
that of simulated calibrations of drawn sensors.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.bench.sensors import calibration_of
from tests.support.stored_output import store
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig
from workbench.optics.rows import rows_of_rig
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.statistics.coverage import clopper_pearson

ROOT = Path(__file__).parents[2]
RIGS = ("thesis", "thesis-both", "diagonal", "three-lines", "ring", "mars-rover")
FAR_MM, OBSTACLE_MM = 3000.0, 500.0
RANGES_MM = (300.0, 1000.0, 3000.0)
FRONT_MM = ((-90.0, 90.0), (-60.0, 40.0))
"""Cross-section of the vehicle of the trial `drive` about the sensor, x and y: clearance to top."""
ROD_MM = 20.0
RODS = 20_000
SENSORS = 3
KINDS = ("vertical", "horizontal", "any direction")


def beams_at(rig: Rig, range_mm: float) -> FloatArray:
    """(L, 2) places of the beams at a range, as designed."""
    rays = [[p.value for p in (one.x_mm, one.y_mm, one.tx, one.ty)] for one in rig.lasers]
    x, y, tx, ty = np.array(rays).T
    return np.stack([x + tx * range_mm, y + ty * range_mm], axis=1)


def in_view(rig: Rig, range_mm: float) -> bool:
    """Whether all spots at a range lie in the image of the rig's pinhole."""
    camera = rig.camera
    centre = np.array([camera.cx_px.value, camera.cy_px.value])
    px = centre + camera.f_px.value * beams_at(rig, range_mm) / range_mm
    return bool(((px >= -0.5) & (px < np.array([camera.width_px, camera.height_px]) - 0.5)).all())


def nearest_mm(rig: Rig) -> float:
    """Nearest range at which all spots are in the image, by bisection to 0.1 mm."""
    low, high = 1.0, 5000.0
    while high - low > 0.1:
        middle = (low + high) / 2
        low, high = (low, middle) if in_view(rig, middle) else (middle, high)
    return high


def view_line(name: str, rig: Rig) -> str:
    """Row of the field of view."""
    nearest = nearest_mm(rig)
    extents = [np.ptp(beams_at(rig, mm), axis=0) for mm in (nearest, FAR_MM)]
    rows = [row for row in rows_of_rig(rig) if len(row.members) > 1]
    cells = [name, len(rig.lasers), ", ".join(row.name for row in rows) or "none", f"{nearest:.0f}"]
    return " | ".join(map(str, [*cells, *(f"{mm:.0f}" for extent in extents for mm in extent)]))


def resolution_line(name: str, rig: Rig, sensors: int, seed: int) -> str:
    """Row of the resolution, over sensors drawn from the rig's tolerances."""
    one: list[list[float]] = []
    together: list[list[float]] = []
    per_px = []
    for n in range(sensors):
        emulator = dict(rig.emulator or {}) | {"seed": 1000 * seed + n}
        sensor = CalibratedSensor(calibration_of(rig.model_copy(update={"emulator": emulator})))
        one.append([])
        together.append([])
        for mm in RANGES_MM:
            at = np.full(len(sensor.ids), mm)
            px = np.concatenate([sensor.spot_px(i, np.array([mm])) for i in sensor.ids])
            found = sensor.ranges(sensor.ids, px, np.full_like(px, np.nan))
            weight = found.spot_sd_mm**-2 / (found.spot_sd_mm**-2).sum()
            one[-1].append(float((found.sigma_mm / at).mean()))
            together[-1].append(float(np.sqrt(weight @ found.covariance_mm2 @ weight) / mm))
        step = [np.diff(sensor.spot_px(i, np.array([1000.0, 1001.0])), axis=0)[0] for i in sensor.ids]
        per_px.append(float(np.mean([1.0 / np.hypot(*by) for by in step])))
    pairs = zip(np.mean(one, axis=0), np.mean(together, axis=0), strict=True)
    cells = [f"{share:.6f}" for pair in pairs for share in pair]
    return " | ".join([name, *cells, f"{np.mean(per_px):.2f}"])


def rods(kind: str, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Normals (n, 2) and offsets (n,) of rods whose axes cross the vehicle's cross-section."""
    angle = {"vertical": np.zeros(count), "horizontal": np.full(count, np.pi / 2)}.get(
        kind, rng.uniform(0.0, np.pi, count)
    )
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = np.array([(x, y) for x in FRONT_MM[0] for y in FRONT_MM[1]])
    reach = normal @ corners.T
    return normal, rng.uniform(reach.min(axis=1), reach.max(axis=1))


def missed(rig: Rig, kind: str, rng: np.random.Generator, count: int = RODS) -> int:
    """Number of rods that no beam's axis meets at `OBSTACLE_MM`."""
    normal, offset = rods(kind, rng, count)
    away = np.abs(normal @ beams_at(rig, OBSTACLE_MM).T - offset[:, None])
    return int((away.min(axis=1) > ROD_MM / 2).sum())


def missed_line(name: str, rig: Rig, seed: int) -> str:
    """Row of the missed rods: shares with the upper end of their 95 % intervals."""
    cells = []
    for n, kind in enumerate(KINDS):
        count = missed(rig, kind, np.random.default_rng([seed, n]))
        cells += [f"{count / RODS:.4f}", f"{clopper_pearson(count, RODS)[1]:.4f}"]
    return " | ".join([name, *cells])


def main(arguments: Sequence[str] | None = None) -> int:
    """Compute and store the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sensors", type=int, default=SENSORS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    rigs = {name: load_rig(ROOT / f"rigs/{name}-emulated.yaml") for name in RIGS}
    lines = [
        "",
        "field of view",
        "rig | lasers | rows | all in view from | width | height | width at 3 m | height at 3 m",
        *(view_line(name, rig) for name, rig in rigs.items()),
        "",
        "resolution",
        "rig | one at 300 | all at 300 | one at 1000 | all at 1000 | one at 3000 | all at 3000 | per px",
        *(resolution_line(name, rig, given.sensors, given.seed) for name, rig in rigs.items()),
        "",
        "missed rods",
        "rig | vertical | at most | horizontal | at most | any direction | at most",
        *(missed_line(name, rig, given.seed) for name, rig in rigs.items()),
        "",
    ]
    options = f"--sensors {given.sensors} --seed {given.seed}"
    store("layouts", "Layouts of lasers compared", f"python -m tests.proofs.layouts {options}", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
