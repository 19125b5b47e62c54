"""Time from a pair of frames to four spots, against OpenCV's chain and one subtraction of the same frames."""

from __future__ import annotations

import timeit
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.render import Sensor, spot
from workbench.spots import Scanline, SpotFinder

SHAPE = (480, 640)
ROW = 240.0
COLUMNS = (212.0, 274.0, 366.0, 428.0)
THRESHOLD_DN = 50
PAIRS = 48
SENSOR = Sensor(electrons_per_dn=10.0, read_sd_electrons=5.0, bits=8, black_dn=0.0)
Frame = NDArray[np.uint8]
Task = Callable[[Frame, Frame], object]


def frame_pairs() -> list[tuple[Frame, Frame]]:
    """Different pairs, as a camera delivers them: together larger than the caches of the core."""
    rng = np.random.default_rng(2)
    pairs = []
    for _ in range(PAIRS):
        dark = np.full(SHAPE, 120.0)
        row, shift = ROW + rng.uniform(-1, 1), rng.uniform(-20, 20)
        light = dark + sum(15000.0 * spot(SHAPE, u + shift, row, 1.5, 1.5) for u in COLUMNS)
        pairs.append((SENSOR.expose(light, rng).astype(np.uint8), SENSOR.expose(dark, rng).astype(np.uint8)))
    return pairs


def chain(on: Frame, off: Frame) -> object:
    """OpenCV: subtract, threshold, connected components with their centroids."""
    _, binary = cv2.threshold(cv2.subtract(on, off), THRESHOLD_DN, 255, cv2.THRESH_BINARY)
    return cv2.connectedComponentsWithStats(binary)[3]


def time_us(task: Task, pairs: list[tuple[Frame, Frame]]) -> float:
    """Microseconds a pair: the fastest of sixty rounds over all pairs, for others may use the core, too."""

    def every_pair() -> None:
        for on, off in pairs:
            task(on, off)

    return min(timeit.repeat(every_pair, number=1, repeat=60)) / len(pairs) * 1e6


def lines() -> Iterator[str]:
    """The table, line by line."""
    cv2.setNumThreads(1)
    pairs = frame_pairs()
    finder = SpotFinder(SHAPE, [Scanline(0.0, ROW, 1.0, 0.0, 3.0)], expected=len(COLUMNS))
    assert all(len(finder.find(*pair).spots) == len(COLUMNS) for pair in pairs)
    yield f"Time from a {SHAPE[1]} x {SHAPE[0]} uint8 pair to {len(COLUMNS)} spots, one core, microseconds."
    yield "Targets: OpenCV's chain / ours >= 10; ours / one cv2.subtract <= 5."
    yield f"{'frames':>28}{'subtract':>10}{'chain':>10}{'ours':>10}{'chain/ours':>12}{'ours/subtract':>15}"
    for name, some in ((f"{PAIRS} pairs in turn", pairs), ("one pair again and again", pairs[:1] * PAIRS)):
        subtract, opencv, ours = (time_us(task, some) for task in (cv2.subtract, chain, finder.find))
        times = f"{subtract:10.1f}{opencv:10.1f}{ours:10.1f}"
        yield f"{name:>28}{times}{opencv / ours:12.2f}{ours / subtract:15.2f}"
