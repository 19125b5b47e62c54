"""The experiment: draw sensors, calibrate them all, range targets that no calibration has seen."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tests.proofs import bound, simulate
from tests.proofs.joint import joint_p
from tests.proofs.ranging import ranges
from tests.proofs.solve import Solve, at_once
from workbench.calibration.data.observations import Observation, PlacementInfo, group
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig

RANGES_MM = np.array([120.0, 180.0, 270.0, 400.0, 600.0, 900.0, 1400.0, 2100.0, 3200.0, 5000.0])
HELD_MM = np.array(
    [125.0, 140.0, 180.0, 250.0, 350.0, 500.0, 750.0, 1100.0, 1700.0, 2000.0, 2700.0, 3800.0, 4500.0]
)
"""Standoffs of procedures/accuracy-flat.yaml, and the ends of the two bands."""


@dataclass(frozen=True)
class Outcome:
    """Errors (measured - true), stated standard deviations and bounds on the variance, N calibrations."""

    parameter: FloatArray
    """(N, S)"""
    parameter_sd: FloatArray
    parameter_bound: FloatArray
    range: FloatArray
    """(N, K, L) at RANGES_MM; NaN where the spot was out of the frame. Beyond infinity: infinite."""
    range_sd: FloatArray
    range_bound: FloatArray
    held: FloatArray
    """(N, H, L) at HELD_MM, one spot each."""
    held_flat: FloatArray
    """(N, H) of all lasers together, as the ranger puts them."""
    noise_scaled: FloatArray
    """(N,) 1 where the fit found the residuals too large for the stated noise."""
    unsolved: FloatArray
    """(N,) 1 where the fit did not converge."""
    missing: FloatArray
    """(N,) share of the cells without a spot in the frame."""
    joint_p: FloatArray
    """(N,) P value of all parameters together."""


def run(
    rig: Rig, standoffs_mm: FloatArray, repeats: int, n: int, rng: np.random.Generator, solve: Solve = at_once
) -> Outcome:
    """Simulate and score N calibrations."""
    data = simulate.calibrations(rig, standoffs_mm, repeats, n, rng)
    fitted = solve(rig, placements(rig, standoffs_mm), data)
    covariance = bound.parameter_covariance(rig, standoffs_mm, data)
    spot_sd = float(np.hypot(rig.noise.spot_sd_px, rig.noise.speckle_sd_px))
    stated = spot_sd * fitted.noise_scale

    far = ranges(rig, fitted.sensor, fitted.covariance, _read(rig, data.truth, RANGES_MM, rng), stated)
    held = ranges(rig, fitted.sensor, fitted.covariance, _read(rig, data.truth, HELD_MM, rng), stated)
    flat, _ = held.flat(fitted.covariance)
    return Outcome(
        parameter=fitted.sensor - data.truth,
        parameter_sd=np.sqrt(np.diagonal(fitted.covariance, axis1=1, axis2=2)),
        parameter_bound=np.diagonal(covariance, axis1=1, axis2=2),
        range=far.range_mm - RANGES_MM[:, None],
        range_sd=far.sd_mm,
        range_bound=bound.range_variance(rig, data.truth, covariance, RANGES_MM, spot_sd),
        held=held.range_mm - HELD_MM[:, None],
        held_flat=flat - HELD_MM,
        noise_scaled=(fitted.noise_scale > 1).astype(float),
        unsolved=1.0 - fitted.converged,
        missing=np.isnan(data.position_px[..., 0]).mean(axis=(1, 2)),
        joint_p=joint_p(rig, fitted.sensor, fitted.covariance, data.truth),
    )


def placements(rig: Rig, standoffs_mm: FloatArray) -> tuple[PlacementInfo, ...]:
    """The target at standoffs (J,), square, with the rig's tolerances."""
    seen = [
        Observation(f"{s:g} mm", rig.laser_ids[0], f"{s:g} mm", s, 0, 0.0, 0.0) for s in standoffs_mm.tolist()
    ]
    return group(seen, rig.laser_ids, rig.noise)[0].placements


def joined(parts: list[Outcome]) -> Outcome:
    """The calibrations of all parts."""
    return Outcome(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Outcome)))


def _read(rig: Rig, truth: FloatArray, range_mm: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(N, K, L, 2) one spot of each laser on a square target at true ranges; NaN out of the frame."""
    z0 = range_mm + truth[:, simulate.lens_size(rig)][:, None]
    seen = simulate.spots(rig, truth, z0, np.zeros((*z0.shape, 2)))
    for sd in (rig.noise.speckle_sd_px, rig.noise.spot_sd_px):
        seen = seen + rng.normal(0.0, sd, seen.shape)
    return np.where(simulate.in_frame(rig, seen)[..., None], seen, np.nan)
