"""Sensors drawn from a rig's tolerances and their images: linear algebra and OpenCV's lens, nothing of ours.

Pixels, millimetres; camera frame as in OpenCV. N sensors, J placements, L lasers, S parameters of the sensor:
lens, bench, four a laser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.support.rigs import opencv_pixels
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.prior import Prior
from workbench.model.rig import Rig

LENSES: dict[str, tuple[str, ...]] = {
    "plumb_bob": ("f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"),
    "equidistant": ("f_px", "cx_px", "cy_px", "k1", "k2", "k3", "k4"),
}
BENCH = ("offset_mm", "ruler_scale", "target_slope_x", "target_slope_y", "drift_u_px", "drift_v_px")
RAY = ("x_mm", "y_mm", "tx", "ty")


@dataclass(frozen=True)
class Calibrations:
    """What N sensors gave to fit."""

    truth: FloatArray
    """(N, S)"""
    errors: FloatArray
    """(N, J, 3) true placement error in mm and tangents of the tilts."""
    position_px: FloatArray
    """(N, J, L, 2) means of the repeats, NaN where every one fell out of the frame."""
    sd_px: FloatArray
    """(N, J, L, 2) 1 sigma of the means, speckle included; NaN likewise."""


def priors(rig: Rig) -> list[Prior]:
    """(S) priors of the sensor's parameters."""
    lens = [getattr(rig.camera, name) for name in LENSES[rig.camera.lens]]
    bench = [getattr(rig.bench, name) for name in BENCH]
    return [*lens, *bench, *(getattr(laser, name) for laser in rig.lasers for name in RAY)]


def names(rig: Rig) -> list[str]:
    """(S) names of the sensor's parameters."""
    return [*LENSES[rig.camera.lens], *BENCH, *(f"{laser.id}.{name}" for laser in rig.lasers for name in RAY)]


def lens_size(rig: Rig) -> int:
    """Number of the lens's parameters; the offset comes next, then the ruler's scale."""
    return len(LENSES[rig.camera.lens])


def draw_truths(rig: Rig, n: int, rng: np.random.Generator) -> FloatArray:
    """(N, S) sensors drawn from the rig's priors."""
    return np.stack([rng.normal(p.value, p.sd, n) for p in priors(rig)], axis=1)


def spots(rig: Rig, sensors: FloatArray, z0_mm: FloatArray, slopes: FloatArray) -> FloatArray:
    """(N, J, L, 2) where the lasers' spots on planes appear; NaN beyond the fold of the drawn lens.

    k1 and k2 drawn from wide tolerances can make a polynomial that folds over within the picture, so that one
    pixel belongs to two ranges. No lens does that: beyond its fold a model shows nothing.

    Args:
        rig: kind of lens.
        sensors: (N, S).
        z0_mm: (N, J) depth of each plane on the camera's axis.
        slopes: (N, J, 2) tangents of its tilts.
    """
    lens = lens_size(rig)
    rays = sensors[:, None, lens + len(BENCH) :].reshape(len(sensors), 1, -1, len(RAY))
    shape = (*z0_mm.shape, rays.shape[2])
    x, y, tx, ty = (np.broadcast_to(part, shape) for part in np.moveaxis(rays, -1, 0))
    system = np.zeros((*shape, 3, 3))
    system[..., 0, 0] = system[..., 1, 1] = system[..., 2, 2] = 1.0
    system[..., 0, 2], system[..., 1, 2] = -tx, -ty
    system[..., 2, :2] = -slopes[:, :, None, :]
    depth = np.broadcast_to(z0_mm[:, :, None], shape)
    points = np.linalg.solve(system, np.stack([x, y, depth], axis=-1)[..., None])[..., 0]
    name = rig.camera.lens
    seen = [
        opencv_pixels(name, sensor[:lens], p.reshape(-1, 3))
        for sensor, p in zip(sensors, points, strict=True)
    ]
    unfolded = UNFOLDED[name](sensors[:, 3:lens, None, None], np.asarray(points, float))
    return np.where(unfolded[..., None], np.stack(seen).reshape(*shape, 2), np.nan)


def depths(
    rig: Rig, sensors: FloatArray, standoff_mm: FloatArray, error_mm: FloatArray | float = 0.0
) -> FloatArray:
    """(N, J) depths of planes at standoffs (J,) by the ruler."""
    offset, scale = sensors[:, lens_size(rig)], sensors[:, lens_size(rig) + 1]
    return standoff_mm * (1.0 + scale[:, None]) + offset[:, None] + error_mm


def tilted(rig: Rig, sensors: FloatArray, slopes: FloatArray) -> FloatArray:
    """(N, J, 2) slopes of the target, by those of each placement and the tilt that all share."""
    start = lens_size(rig) + BENCH.index("target_slope_x")
    common = np.arctan(sensors[:, None, start : start + 2])
    return np.asarray(np.tan(np.arctan(slopes) + common))


def in_frame(rig: Rig, position_px: FloatArray) -> BoolArray:
    """(...) whether positions (..., 2) lie between the centres of the outermost pixels."""
    size = np.array([rig.camera.width_px, rig.camera.height_px])
    return np.asarray(((position_px >= 0) & (position_px <= size - 1)).all(axis=-1))


def calibrations(
    rig: Rig, standoffs_mm: FloatArray, repeats: int, n: int, rng: np.random.Generator
) -> Calibrations:
    """Draw N sensors, place the target with errors and tilts, see every spot `repeats` times."""
    truth = draw_truths(rig, n, rng)
    error = rng.normal(0.0, rig.bench.placement_sd_mm, (n, len(standoffs_mm)))
    slopes = np.tan(np.radians(rng.normal(0.0, rig.bench.tilt_sd_deg, (*error.shape, 2))))
    centre = spots(rig, truth, depths(rig, truth, standoffs_mm, error), tilted(rig, truth, slopes))
    centre = centre + rng.normal(0.0, rig.noise.speckle_sd_px, centre.shape)
    single = centre[..., None, :] + rng.normal(0.0, rig.noise.spot_sd_px, (*centre.shape[:-1], repeats, 2))
    seen = in_frame(rig, single)
    count = seen.sum(axis=-1)[..., None].astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(seen[..., None], single, 0.0).sum(axis=-2) / count
        sd = np.hypot(rig.noise.spot_sd_px / np.sqrt(count), rig.noise.speckle_sd_px)
    sd = np.broadcast_to(np.where(count > 0, sd, np.nan), mean.shape)
    return Calibrations(truth, np.concatenate([error[..., None], slopes], axis=-1), mean, sd)


def _plumb_bob_unfolded(coefficients: FloatArray, points: FloatArray) -> BoolArray:
    """(N, J, L) whether the distorted radius still grows with the radius; coefficients (N, 5, 1, 1)."""
    k1, k2, _, _, k3 = np.moveaxis(coefficients, 1, 0)
    r2 = (points[..., 0] ** 2 + points[..., 1] ** 2) / points[..., 2] ** 2
    return np.asarray(1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) > 0)


def _equidistant_unfolded(coefficients: FloatArray, points: FloatArray) -> BoolArray:
    """(N, J, L) whether the distorted radius grows with the angle up to there; coefficients (N, 4, 1, 1)."""
    angle = np.arctan2(np.hypot(points[..., 0], points[..., 1]), points[..., 2])
    grows = np.ones(angle.shape, bool)
    for part in np.linspace(0.0, 1.0, 50):
        a2 = (part * angle) ** 2
        slope = 1.0 + sum((2 * n + 3) * coefficients[:, n] * a2 ** (n + 1) for n in range(4))
        grows &= slope > 0
    return grows


UNFOLDED = {"plumb_bob": _plumb_bob_unfolded, "equidistant": _equidistant_unfolded}
