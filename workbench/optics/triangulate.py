"""Triangulation: depth of a laser's point from its spot, with derivatives by all parameters.

It can be batched over sensors, and is the reference for `workbench.sensor.curves`, which is fast for one.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.optics.lens import LensModel, Numbers
from workbench.optics.rays import Ray, spot_at_inverse_depth

ITERATIONS = 20
"""Number of Gauss-Newton steps. Each is exact except for distortion: six reach rounding for a usual lens, ten
for a fisheye at 80 degrees. The others are for lenses close to their fold, at negligible cost."""


class MeasuredSpot(NamedTuple):
    """A measured spot, pixels, 1 sigma.

    A coordinate that was not measured has an infinite sd, and any finite value.
    """

    u_px: ArrayLike
    v_px: ArrayLike
    u_sd_px: ArrayLike
    v_sd_px: ArrayLike


class DepthEstimate(NamedTuple):
    """Depth z = 1 / inverse_depth, and the derivatives of z."""

    inverse_depth_per_mm: Array
    """Not positive where the spot lies at or beyond the laser's vanishing point."""
    across_sd: Array
    """Signed distance of the spot from the laser's line in the image, in standard deviations of the spot."""
    z_sd_of_spot_mm: Array
    """1 sigma of z from the spot's own standard deviation."""
    dz_dlens: Array
    """(P,) derivatives of z by the lens's parameters, in the model's order."""
    dz_dray: Array
    """(4,) derivatives of z by x, y, tx, ty."""
    dacross_dlens: Array
    """(P,) derivatives of `across_sd`."""
    dacross_dray: Array
    """(4,) derivatives of `across_sd`."""


def estimate_depth(model: LensModel, lens: Numbers, ray: Ray, spot: MeasuredSpot) -> DepthEstimate:
    """Maximum-likelihood depth of the point of `ray` that is seen at `spot`; scalars in, batch with `vmap`.

    The only unknown, the inverse depth w, is found by Gauss-Newton on the residual in standard deviations.
    The loop is JAX-traceable, as `vmap` requires. Derivatives are those of the normal equation at the
    optimum, neglecting the curvature of the residual across the laser's line, which is below the residual
    over the focal length.

    Args:
        model: lens model.
        lens: (P,) parameters of the lens, in the model's order.
        ray: ray of the laser.
        spot: the measured spot.
    """
    inverse_sd = jnp.array([1.0 / spot.u_sd_px, 1.0 / spot.v_sd_px])

    def residual(w: ArrayLike, lens_vector: Array, ray_vector: Array) -> Array:
        u, v = spot_at_inverse_depth(model, lens_vector, Ray(*ray_vector), w)
        return jnp.array([u - spot.u_px, v - spot.v_px]) * inverse_sd

    lens_vector = jnp.array([jnp.asarray(value, float) for value in lens])
    ray_vector = jnp.array([jnp.asarray(value, float) for value in ray])

    def step(_: int, w: Array) -> Array:
        value, slope = jax.jvp(lambda w: residual(w, lens_vector, ray_vector), (w,), (jnp.ones_like(w),))
        return jnp.asarray(w - (slope @ value) / (slope @ slope))

    # From infinity the first step is exact for a pinhole; the others correct for distortion.
    w = jax.lax.fori_loop(0, ITERATIONS, step, jnp.zeros(()))
    by_w, by_lens, by_ray = jax.jacfwd(residual, argnums=(0, 1, 2))(w, lens_vector, ray_vector)
    information = by_w @ by_w
    across = jnp.array([-by_w[1], by_w[0]]) / jnp.sqrt(information)
    dz_dw = -1.0 / w**2
    return DepthEstimate(
        inverse_depth_per_mm=w,
        across_sd=across @ residual(w, lens_vector, ray_vector),
        z_sd_of_spot_mm=jnp.abs(dz_dw) / jnp.sqrt(information),
        dz_dlens=-dz_dw * (by_w @ by_lens) / information,
        dz_dray=-dz_dw * (by_w @ by_ray) / information,
        dacross_dlens=across @ by_lens,
        dacross_dray=across @ by_ray,
    )
