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
SHAPES = (SHAPE, (960, 1280), (1536, 2048), (3072, 4096))
COLUMNS = (212.0, 274.0, 366.0, 428.0)
"""Positions of the spots in frames of SHAPE; in larger ones they are scaled by the width."""
HALF_WIDTH_PX = 3.0
FEWEST_PAIRS = 4
THRESHOLD_DN = 50
PAIRS = 48
SENSOR = Sensor(electrons_per_dn=10.0, read_sd_electrons=5.0, bits=8, black_dn=0.0)
Frame = NDArray[np.uint8]
Task = Callable[[Frame, Frame], object]


def scanline(shape: tuple[int, int]) -> Scanline:
    """The middle row."""
    return Scanline(0.0, 0.5 * shape[0], 1.0, 0.0, HALF_WIDTH_PX)


def frame_pairs(shape: tuple[int, int] = SHAPE) -> list[tuple[Frame, Frame]]:
    """Different pairs, as a camera delivers them: together larger than the caches of the core."""
    rng = np.random.default_rng(2)
    pairs = []
    for _ in range(max(FEWEST_PAIRS, PAIRS * SHAPE[0] * SHAPE[1] // (shape[0] * shape[1]))):
        dark = np.full(shape, 120.0)
        row, shift, scale = 0.5 * shape[0] + rng.uniform(-1, 1), rng.uniform(-20, 20), shape[1] / SHAPE[1]
        light = dark + sum(15000.0 * spot(shape, scale * (u + shift), row, 1.5, 1.5) for u in COLUMNS)
        pairs.append((SENSOR.expose(light, rng).astype(np.uint8), SENSOR.expose(dark, rng).astype(np.uint8)))
    return pairs


def finder_of(shape: tuple[int, int], pairs: list[tuple[Frame, Frame]]) -> SpotFinder:
    """A search that finds all spots of these pairs."""
    finder = SpotFinder(shape, [scanline(shape)], expected=len(COLUMNS))
    assert all(len(finder.find(*pair).spots) == len(COLUMNS) for pair in pairs)
    return finder


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
    finder = finder_of(SHAPE, pairs)
    yield f"Time from a {SHAPE[1]} x {SHAPE[0]} uint8 pair to {len(COLUMNS)} spots, one core, microseconds."
    yield "Targets: OpenCV's chain / ours >= 10; ours / one cv2.subtract of pairs in turn <= 4."
    yield f"{'frames':>28}{'subtract':>10}{'chain':>10}{'ours':>10}{'chain/ours':>12}{'ours/subtract':>15}"
    for name, some in ((f"{PAIRS} pairs in turn", pairs), ("one pair again and again", pairs[:1] * PAIRS)):
        subtract, opencv, ours = (time_us(task, some) for task in (cv2.subtract, chain, finder.find))
        times = f"{subtract:10.1f}{opencv:10.1f}{ours:10.1f}"
        yield f"{name:>28}{times}{opencv / ours:12.2f}{ours / subtract:15.2f}"
    yield ""
    yield from _by_size()


def _by_size() -> Iterator[str]:
    yield "The same by the size of the frame, pairs in turn. Only the neighbourhood of the scanline is read:"
    yield "time grows with the width, not with the number of pixels."
    yield "Target: ours / subtract <= 0.5 at the largest."
    ratios = f"{'ours/subtract':>15}{'ours/first':>12}{'width/first':>13}"
    yield f"{'frames':>28}{'subtract':>10}{'ours':>10}{ratios}"
    first = 0.0
    for shape in SHAPES:
        pairs = frame_pairs(shape)
        subtract, ours = (time_us(task, pairs) for task in (cv2.subtract, finder_of(shape, pairs).find))
        first = first or ours
        size, width = f"{shape[1]} x {shape[0]}", shape[1] / SHAPE[1]
        ratios = f"{ours / subtract:15.2f}{ours / first:12.2f}{width:13.1f}"
        yield f"{size:>28}{subtract:10.1f}{ours:10.1f}{ratios}"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
