"""Spots found and false spots, over 10 000 pairs with clutter, ambient jumps, hot pixels and reflections."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from tests.benchmarks.render import Sensor, spot
from workbench.model.arrays import FloatArray
from workbench.spots import Scanline, SpotFinder

PAIRS = 10_000
# A band of the image around the scanline: the finder reads no more unless spots are missing.
SHAPE, ROW = (64, 640), 32.0
F_PX, CENTRE_PX, BLUR_PX = 541.0, 320.0, 0.6
BASELINES_MM = (-60.0, -30.0, 30.0, 60.0)
SENSOR = Sensor(electrons_per_dn=40.0, read_sd_electrons=15.0, bits=8, black_dn=2.0)
FLUX_AT_1_M = 6e4
# Peak of the spot over the standard deviation of the difference image without the spot; dimmer is invisible.
VISIBLE_SNR = 6.0
_NEAR_WIDTHS, _NEAR_PX = 3.0, 1.0


@dataclass(frozen=True)
class Truth:
    """A spot that was drawn."""

    u_px: float
    v_px: float
    width_px: float
    visible: bool


@dataclass
class Count:
    """What came of many pairs."""

    visible: int = 0
    found: int = 0
    reported: int = 0
    false: int = 0


def clutter(rng: np.random.Generator) -> FloatArray:
    """Ambient light (electrons) on a scene of bright and dark patches, out of focus like everything."""
    scene = np.full(SHAPE, rng.uniform(50.0, 600.0))
    for _ in range(int(rng.integers(0, 12))):
        u, v = int(rng.integers(0, SHAPE[1])), int(rng.integers(0, SHAPE[0]))
        scene[v : v + int(rng.integers(4, 50)), u : u + int(rng.integers(4, 120))] *= rng.uniform(0.3, 3.0)
    return np.asarray(cv2.GaussianBlur(scene, (0, 0), BLUR_PX), np.float64)


def lasers(rng: np.random.Generator, ambient: FloatArray) -> tuple[FloatArray, list[Truth]]:
    """Light of the lasers on a flat target, and the truth."""
    z_mm = float(np.exp(rng.uniform(np.log(100.0), np.log(5000.0))))
    row = ROW + rng.uniform(-1.5, 1.5)
    width = float(np.hypot(F_PX * (1.5 + 1.6e-3 * z_mm) / 4.0 / z_mm, BLUR_PX))
    light, truths = np.zeros(SHAPE), []
    # The exposure follows the brightest spot: automatic, up to twice too long.
    most = (
        rng.uniform(0.3, 2.0)
        * SENSOR.full_scale_dn
        * SENSOR.electrons_per_dn
        * 2.0
        * np.pi
        * (width**2 + 0.1)
    )
    for baseline in BASELINES_MM:
        u = CENTRE_PX + F_PX * baseline / z_mm
        flux = min(FLUX_AT_1_M * rng.uniform(0.1, 1.0) * (1000.0 / z_mm) ** 2, most)
        profile = flux * spot(SHAPE, u, row, width, width)
        light += profile
        inside = width < u < SHAPE[1] - 1 - width
        noise = _noise_electrons(ambient, row, u) if inside else np.inf
        truths.append(Truth(u, row, width, bool(profile.max() >= VISIBLE_SNR * noise)))
    return light, truths


def _noise_electrons(ambient: FloatArray, v: float, u: float) -> float:
    """Standard deviation of the difference image where a spot lies, without the spot."""
    here = float(ambient[round(v), round(u)])
    return float(np.sqrt(2.0 * (here + SENSOR.read_sd_electrons**2 + SENSOR.electrons_per_dn**2 / 12.0)))


def nuisances(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Light in the on-frame alone (reflections, blinking pixels) and in both frames (hot pixels)."""
    on, both = np.zeros(SHAPE), np.zeros(SHAPE)
    for _ in range(int(rng.integers(0, 3))):
        row = ROW + rng.choice((-1, 1)) * rng.uniform(9.0, 20.0)
        width = rng.uniform(0.7, 2.0)
        on += rng.uniform(2e3, 4e4) * spot(SHAPE, rng.uniform(0, SHAPE[1]), row, width, width)
    for frame, count in ((both, 20), (on, 2)):
        frame[rng.integers(0, SHAPE[0], count), rng.integers(0, SHAPE[1], count)] += rng.uniform(
            500.0, 8000.0, count
        )
    return on, both


def one_pair(rng: np.random.Generator, finder: SpotFinder, count: Count) -> None:
    """Draw a pair, search it, count."""
    ambient = clutter(rng)
    jump = rng.uniform(0.7, 1.4) if rng.random() < 0.3 else 1.0
    light, truths = lasers(rng, ambient * max(jump, 1.0))
    on_only, both = nuisances(rng)
    on = SENSOR.expose(ambient * jump + light + on_only + both, rng)
    off = SENSOR.expose(ambient + both, rng)
    spots = finder.find(on, off).spots
    taken = set()
    for s in spots:
        apart = [np.hypot(s.u_px - t.u_px, s.v_px - t.v_px) for t in truths]
        i = int(np.argmin(apart))
        if apart[i] <= max(_NEAR_WIDTHS * truths[i].width_px, _NEAR_PX) and i not in taken:
            taken.add(i)
        else:
            count.false += 1
    count.reported += len(spots)
    count.visible += sum(t.visible for t in truths)
    count.found += sum(t.visible for i, t in enumerate(truths) if i in taken)


def run(pairs: int = PAIRS, seed: int = 3) -> Count:
    """Count over many pairs."""
    finder = SpotFinder(SHAPE, [Scanline(0.0, ROW, 1.0, 0.0, 4.0)], expected=len(BASELINES_MM))
    rng, count = np.random.default_rng(seed), Count()
    for _ in range(pairs):
        one_pair(rng, finder, count)
    return count


def lines() -> Iterator[str]:
    """The table, line by line."""
    count = run()
    found, false = 100 * count.found / count.visible, 100 * count.false / count.reported
    yield f"Detection: {PAIRS} pairs, 0.1 - 5 m, frames of {SHAPE[1]} x {SHAPE[0]} px around the scanline."
    yield f"Visible: inside the image, peak at least {VISIBLE_SNR:g} sd of the difference without the spot."
    yield f"visible {count.visible}, found {count.found}: {found:.3f} % (target >= 99.5)"
    yield f"reported {count.reported}, false {count.false}: {false:.3f} % (target <= 0.1)"
