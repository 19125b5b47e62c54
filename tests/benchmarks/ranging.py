"""Time from a pair of frames to ranges, shape and sigmas, against one subtraction of the same frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from tests.benchmarks.render import spot
from tests.benchmarks.speed import SENSOR, SHAPE, Frame
from tests.support.rigs import PROVENANCE, World
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig, nearest_image_axis
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.spots import Finding, SpotFinder

RIG = Path(__file__).parents[2] / "rigs/thesis-both-emulated.yaml"
PAIRS, ROUNDS, WARM_UP = 48, 40, 96
Scene = Callable[[str, float], float]
"""Range in mm of a laser's spot, from its axis and its place along it."""
Pair = tuple[Frame, Frame]
SCENES: dict[str, Scene] = {
    "flat": lambda axis, x: 700.0,
    "flat at 3 m": lambda axis, x: 3000.0,
    "incline": lambda axis, x: 700.0 + 0.6 * x,
    "cylinder": lambda axis, x: 389.0 - float(np.sqrt(89.0**2 - (x - 15.0) ** 2)) if axis == "u" else 300.0,
}


class Bench:
    """A ranger of some lines of lasers, and frames of one scene for it."""

    def __init__(self, axes: str, rig: Rig | None = None) -> None:
        rig = rig or load_rig(RIG)
        self.rig = rig.model_copy(
            update={"lasers": tuple(s for s in rig.lasers if nearest_image_axis(s) in axes)}
        )
        self.world = World(self.rig, 3)
        calibration, _ = calibrate(fit(self.rig, self.world.observations()), Acceptance(), PROVENANCE)
        self.ranger = Ranger(calibration)
        ids = self.ranger.sensor.ids
        self.finders = {
            fired: SpotFinder(SHAPE, self.ranger.searched(fired), expected=len(fired), reasons=False)
            for fired in (ids, *((i,) for i in ids))
        }

    def pair(self, scene: Scene, fired: tuple[str, ...], rng: np.random.Generator) -> Pair:
        """Lit and dark frame."""
        dark = np.full(SHAPE, 120.0)
        light = dark.copy()
        for laser in self.rig.lasers:
            if laser.id in fired:
                depth = self._depth(laser.id, nearest_image_axis(laser), scene)
                u, v = self.world.pixel(laser.id, depth)
                light += 15_000.0 * spot(SHAPE, u, v, 1.5, 1.5)
        return SENSOR.expose(light, rng).astype(np.uint8), SENSOR.expose(dark, rng).astype(np.uint8)

    def _depth(self, laser_id: str, axis: str, scene: Scene) -> float:
        """Depth where the true beam meets the scene, by repetition: it hardly moves sideways."""
        names = ("x_mm", "tx") if axis == "u" else ("y_mm", "ty")
        origin, tangent = (self.world.values[f"{laser_id}.{name}"] for name in names)
        offset, depth = self.world.values["offset_mm"], 500.0
        for _ in range(20):
            depth = scene(axis, origin + tangent * depth) + offset
        return depth

    def read(self, pair: Pair) -> str:
        """One reading; the kinds of its shapes."""
        reading = acquire(self.ranger, "", lambda ids: self.finders[ids].find(*pair))
        return " ".join(line.shape.kind for line in reading.lines)

    def read_worst(self, pairs: dict[tuple[str, ...], Pair]) -> str:
        """One reading whose normal capture tells nothing, and which fires every laser alone."""

        def shoot(ids: tuple[str, ...]) -> Finding:
            found = self.finders[ids].find(*pairs[ids])
            # Nine spots of eight lasers, one of them twice: neither line can be told.
            return Finding((*found.spots, *found.spots)) if len(ids) > 1 else found

        reading = acquire(self.ranger, "", shoot)
        assert reading.status == "done", reading.notes
        return " ".join(line.shape.kind for line in reading.lines)


def times_us(task: Callable[[int], object]) -> tuple[FloatArray, float]:
    """(ROUNDS * PAIRS,) microseconds of each call by the clock, and their mean by the processor's time.

    The clock also counts what else the machine did in between; for the mean of one core that must not count.
    """
    for n in range(WARM_UP):
        task(n % PAIRS)
    taken = []
    began_cpu = time.thread_time()
    for n in [*range(PAIRS)] * ROUNDS:
        began = time.perf_counter()
        task(n)
        taken.append(time.perf_counter() - began)
    busy = time.thread_time() - began_cpu
    return np.array(taken) * 1e6, busy / len(taken) * 1e6


def lines() -> Iterator[str]:
    """The table, line by line."""
    cv2.setNumThreads(1)
    size = f"{SHAPE[1]} x {SHAPE[0]}"
    yield f"Time from a {size} uint8 pair to spots, ranges, shape and sigmas, one core, microseconds."
    yield f"Without camera; {PAIRS} different pairs in turn, {ROUNDS} rounds, after {WARM_UP} readings."
    yield "p50, p99: by the clock. cpu: mean by the processor's time, and the same of one cv2.subtract."
    yield "Worst: spots without information, then every laser alone (5 or 9 pairs a reading)."
    yield "Targets: 1000 readings/s with one line, 500 with both lines; p99 below 3000 us."
    columns = f"{'p50':>8}{'p99':>8}{'cpu':>8}{'readings/s':>12}{'subtract':>10}{'cpu/subtract':>14}"
    yield f"{'scene':>30}{columns}  shape"
    for axes, title in (("u", "horizontal"), ("uv", "both lines")):
        bench = Bench(axes)
        for name, scene in SCENES.items():
            yield _row(f"{title}, {name}", bench, scene)
        yield _row(f"{title}, flat, one not seen", bench, SCENES["flat"], lost=1)
        yield _worst_row(f"{title}, worst", bench)


def _row(name: str, bench: Bench, scene: Scene, lost: int = 0) -> str:
    rng = np.random.default_rng(5)
    pairs = [bench.pair(scene, bench.ranger.sensor.ids[lost:], rng) for _ in range(PAIRS)]
    kinds = sorted({bench.read(pair) for pair in pairs})
    return f"{name:>30}{_columns(lambda n: bench.read(pairs[n]), pairs)}  {' or '.join(kinds)}"


def _worst_row(name: str, bench: Bench) -> str:
    rng, ids = np.random.default_rng(5), bench.ranger.sensor.ids
    sets = [
        {fired: bench.pair(SCENES["flat"], fired, rng) for fired in bench.finders} for _ in range(PAIRS // 8)
    ]
    pairs = [pairs[ids] for pairs in sets] * 8
    return f"{name:>30}{_columns(lambda n: bench.read_worst(sets[n % len(sets)]), pairs)}  alone"


def _columns(task: Callable[[int], object], pairs: list[Pair]) -> str:
    taken, cpu = times_us(task)
    _, subtract = times_us(lambda n: cv2.subtract(*pairs[n]))
    p50, p99 = np.percentile(taken, [50, 99])
    return f"{p50:8.0f}{p99:8.0f}{cpu:8.0f}{1e6 / cpu:12.0f}{subtract:10.1f}{cpu / subtract:14.1f}"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
