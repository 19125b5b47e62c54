"""Error of the centre over the Fisher bound, bias over the pixel phase, honesty of the stated deviation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.others import OTHERS, cut_out
from tests.benchmarks.render import Sensor, spot
from workbench.model.arrays import FloatArray
from workbench.spots import find_spots
from workbench.spots.crlb import CameraNoise, position_bound_px

WIDTHS_PX = (0.6, 1.0, 1.5, 2.5, 4.0)
ELECTRONS = (1e3, 1e4, 1e5)
TRIALS = 2000
# The other packages take milliseconds a spot; they are compared on the first trials, ours on the same ones.
TRIALS_OF_OTHERS = 200
SENSOR = Sensor(electrons_per_dn=8.0, read_sd_electrons=6.0, bits=12, black_dn=10.0)
BACKGROUND_ELECTRONS = 5.0
_BOUND_PHASES = 16


@dataclass(frozen=True)
class Cell:
    """One width and brightness."""

    width_px: float
    electrons: float
    missed: int
    extra: int
    bound_px: float
    rms_px: float
    bias_px: float
    bias_sd_px: float
    z_sd: float
    others: dict[str, float]
    """Root mean square error over ours, on the same frames."""


def measure_cell(width_px: float, electrons: float, trials: int = TRIALS, seed: int = 1) -> Cell:
    """Trials of one cell; each with its own phase, on a frame of its own."""
    rng = np.random.default_rng([seed, int(100 * width_px), int(electrons)])
    side = 2 * int(np.ceil(7 * width_px + 12)) + 1
    phases = rng.uniform(-0.5, 0.5, (trials, 2))
    errors, sds = np.full((trials, 2), np.nan), np.full((trials, 2), np.nan)
    rivals: dict[str, list[FloatArray]] = {name: [] for name in OTHERS}
    extra = 0
    for i, phase in enumerate(phases):
        true = side // 2 + phase
        light = BACKGROUND_ELECTRONS + electrons * spot((side, side), true[0], true[1], width_px, width_px)
        frame = SENSOR.expose(light, rng)
        found = find_spots(frame, saturation_dn=SENSOR.full_scale_dn).spots
        near = [s for s in found if np.hypot(s.u_px - true[0], s.v_px - true[1]) < 3.0 * width_px]
        extra += len(found) - len(near[:1])
        if near:
            errors[i] = near[0].u_px - true[0], near[0].v_px - true[1]
            sds[i] = near[0].u_sd_px, near[0].v_sd_px
        if i < TRIALS_OF_OTHERS:
            half = int(np.ceil(3.0 * width_px)) + 3
            image = cut_out(frame, (side // 2, side // 2), half)
            for name, centre in OTHERS.items():
                rivals[name].append(np.array(centre(image)) - half - phase)
    seen = np.isfinite(errors[:, 0])
    bias, bias_sd = phase_bias(phases[seen], errors[seen])
    ours = errors[:TRIALS_OF_OTHERS][seen[:TRIALS_OF_OTHERS]]
    return Cell(
        width_px,
        electrons,
        int((~seen).sum()),
        extra,
        bound(width_px, electrons, phases[:_BOUND_PHASES]),
        rms(errors[seen]),
        bias,
        bias_sd,
        float(np.std(errors[seen] / sds[seen])),
        {name: rms(np.array(e)) / rms(ours) for name, e in rivals.items()},
    )


def rms(errors: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def bound(width_px: float, electrons: float, phases: FloatArray) -> float:
    """Fisher bound, root mean square over phases and both axes."""
    camera = CameraNoise(SENSOR.electrons_per_dn, SENSOR.read_sd_electrons, BACKGROUND_ELECTRONS)
    bounds = [position_bound_px(electrons, width_px, (float(u), float(v)), camera) for u, v in phases]
    return rms(np.array(bounds))


def phase_bias(phases: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Largest bias over the phase within a pixel, and its sampling deviation.

    The bias repeats with the pixel: mean, sine and cosine of the first two harmonics are fitted to the errors
    and the largest absolute value of the curve is given.
    """
    phase, error = phases.ravel(), errors.ravel()
    waves = _waves(phase)
    coefficients = np.linalg.lstsq(waves, error, rcond=None)[0]
    curve = _waves(np.linspace(-0.5, 0.5, 41)) @ coefficients
    return float(np.abs(curve).max()), float(error.std() * np.sqrt(waves.shape[1] / error.size))


def _waves(phase: FloatArray) -> FloatArray:
    angle = 2.0 * np.pi * phase
    return np.stack([np.ones_like(angle), *(f(k * angle) for k in (1, 2) for f in (np.sin, np.cos))], axis=1)


def lines() -> Iterator[str]:
    """The table, line by line."""
    yield f"Centre of one spot, {TRIALS} trials a cell (others: the first {TRIALS_OF_OTHERS}), {SENSOR},"
    yield f"background {BACKGROUND_ELECTRONS:g} electrons. Targets: rms/bound <= 1.15,"
    yield "sd of z within 0.95 - 1.05, bias <= 0.005 px above 1e4 electrons (+- its sampling deviation)."
    yield "Other packages: their rms error over ours on the same frames; above 1 ours is better."
    names = "".join(f"{name:>20}" for name in OTHERS)
    yield f"{'width':>6}{'electrons':>10}{'bound px':>10}{'rms/bound':>10}{'sd of z':>9}" + (
        f"{'bias px':>17}{'missed':>7}{'extra':>6}{names}"
    )
    for width in WIDTHS_PX:
        for electrons in ELECTRONS:
            cell = measure_cell(width, electrons)
            others = "".join(f"{ratio:20.2f}" for ratio in cell.others.values())
            yield (
                f"{width:6.1f}{electrons:10.0e}{cell.bound_px:10.5f}{cell.rms_px / cell.bound_px:10.3f}"
                f""
                f"{cell.z_sd:9.3f}{cell.bias_px:9.4f}+-{cell.bias_sd_px:.4f}{cell.missed:7d}{cell.extra:6d}{others}"
            )
