"""`python -m tests.benchmarks.speckle`: centres of spots in speckle, by the peak of the spot.

Frames are rendered with a pattern of their own: random amplitudes behind a round pupil. Each pattern is seen
in several frames, as the repeats of a placement. Errors are compared with the two stated deviations: noise,
which repeats average out, and speckle, which they share. Minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.render import Sensor, axis_share
from tests.support.stored_output import store
from workbench.model.arrays import FloatArray
from workbench.spots import SpotFinder

PEAKS_DN = (40.0, 80.0, 120.0, 180.0, 250.0)
WIDTHS_PX = (0.75, 1.0, 1.5, 2.0)
SENSOR = Sensor(electrons_per_dn=40_000 / 255, read_sd_electrons=225.0, bits=8, black_dn=8.0)
"""The thesis's camera: full well and read noise of a 1/3" CCD."""
GRAIN_PX = 0.65 * 2.0 / 7.5
"""Wavelength times f-number over the pitch: 650 nm, f/2, 7.5 um."""
STATED_SD_PX = 0.04
"""Speckle as stated to the finder; a centroid has 0.039 px."""
SHAPE, FINE = (31, 31), 12
PLACEMENTS, REPEATS = 300, 5


@dataclass(frozen=True)
class Cell:
    """Spots of one width and peak; deviations are root mean squares over placements, repeats and axes."""

    error_px: float
    """Of a single frame."""
    scatter_px: float
    """Of the repeats about their mean."""
    noise_sd_px: float
    """Stated, by noise."""
    speckle_sd_px: float
    """Stated, by speckle."""
    z_single: float
    """Deviation of z of a single frame."""
    z_mean: float
    """Deviation of z of the mean of the repeats."""
    coverage: float
    """Of the 95 % interval of a single frame."""
    lost: int


def speckle(rng: np.random.Generator, side: int) -> FloatArray:
    """(side, side) relative intensity on a grid of FINE samples a pixel: mean 1, contrast 1."""
    frequency = np.fft.fftfreq(side, 1.0 / FINE)
    passed = np.hypot(frequency[:, None], frequency) <= 0.5 / GRAIN_PX
    real, imaginary = rng.standard_normal((2, *passed.shape))
    amplitude = np.where(passed, real + 1j * imaginary, 0)
    intensity = np.abs(np.fft.ifft2(amplitude)) ** 2
    relative: FloatArray = intensity / (2.0 * passed.sum() / passed.size**2)
    return relative


def light_of(u: float, v: float, width_px: float, peak_dn: float, rng: np.random.Generator) -> FloatArray:
    """(height, width) electrons of a spot in speckle."""
    height, width = SHAPE
    fine = axis_share(FINE * (v + 0.5) - 0.5, FINE * width_px, FINE * height)[:, None] * axis_share(
        FINE * (u + 0.5) - 0.5, FINE * width_px, FINE * width
    )
    pattern = speckle(rng, FINE * height)[:, : FINE * width]
    smooth = fine.reshape(height, FINE, width, FINE).sum(axis=(1, 3)).max()
    pixels = (fine * pattern).reshape(height, FINE, width, FINE).sum(axis=(1, 3))
    light: FloatArray = pixels * peak_dn * SENSOR.electrons_per_dn / smooth
    return light


def measure_cell(width_px: float, peak_dn: float, lasers: int, seed: int, placements: int) -> Cell:
    """Placements of one cell; `lasers` spots lie side by side in a frame, each in speckle of its own."""
    rng = np.random.default_rng([seed, int(100 * width_px), int(peak_dn), lasers])
    finder = SpotFinder((SHAPE[0], lasers * SHAPE[1]), expected=lasers, speckle_sd_px=STATED_SD_PX)
    dark = np.zeros((SHAPE[0], lasers * SHAPE[1]))
    found = np.full((placements, REPEATS, lasers, 3, 2), np.nan)
    for i in range(placements):
        true = 15.0 + rng.uniform(-0.5, 0.5, (lasers, 2))
        light = np.hstack([light_of(u, v, width_px, peak_dn, rng) for u, v in true])
        for j in range(REPEATS):
            spots = finder.find(SENSOR.expose(light, rng), SENSOR.expose(dark, rng)).spots
            if len(spots) != lasers:
                continue
            for k, spot in enumerate(sorted(spots, key=lambda s: s.u_px)):
                error = spot.u_px - true[k, 0] - k * SHAPE[1], spot.v_px - true[k, 1]
                noise_sd = spot.u_sd_px, spot.v_sd_px
                speckle_sd = spot.u_speckle_sd_px or np.nan, spot.v_speckle_sd_px or np.nan
                found[i, j, k] = error, noise_sd, speckle_sd
    seen = np.isfinite(found[..., 0, 0])
    used = found[seen.all(axis=(1, 2))]
    error, noise_sd, speckle_sd = np.moveaxis(used, 3, 0)
    z = error / np.hypot(noise_sd, speckle_sd)
    mean_sd = np.sqrt((noise_sd**2).mean(axis=1) / REPEATS + (speckle_sd**2).mean(axis=1))
    scatter = (error - error.mean(axis=1, keepdims=True)) * np.sqrt(REPEATS / (REPEATS - 1))
    return Cell(
        rms(error),
        rms(scatter),
        rms(noise_sd),
        rms(speckle_sd),
        rms(z),
        rms(error.mean(axis=1) / mean_sd),
        float((np.abs(z) < 1.96).mean()),
        int((~seen).sum()),
    )


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def lines(seed: int = 1, placements: int = PLACEMENTS) -> Iterator[str]:
    """The table, line by line."""
    yield f"Centres in speckle, {placements} placements of {REPEATS} repeats a cell, {SENSOR},"
    yield f"grains of {GRAIN_PX:.3f} px. Targets: sd of z within 0.95 - 1.05 for single frames and for means."
    yield f"{'lasers':>6}{'width':>6}{'peak':>6}{'rms px':>9}{'repeats':>9}{'stated':>8}{'speckle':>9}" + (
        f"{'z single':>10}{'z mean':>8}{'within 95 %':>13}{'lost':>6}"
    )
    for lasers in (1, 4):
        for width in WIDTHS_PX:
            for peak in PEAKS_DN:
                one = measure_cell(width, peak, lasers, seed, placements if lasers == 1 else placements // 4)
                yield (
                    f"{lasers:6d}{width:6.2f}{peak:6.0f}{one.error_px:9.4f}{one.scatter_px:9.4f}"
                    f"{one.noise_sd_px:8.4f}{one.speckle_sd_px:9.4f}{one.z_single:10.3f}{one.z_mean:8.3f}"
                    f"{100 * one.coverage:13.1f}{one.lost:6d}"
                )


def main() -> int:
    """Print and write."""
    store("speckle", "Speckle", "python -m tests.benchmarks.speckle", ["", *lines()])
    return 0


if __name__ == "__main__":
    sys.exit(main())
