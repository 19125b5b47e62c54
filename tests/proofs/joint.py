"""Joint distribution of all parameters of a calibration, in coordinates in which it is nearly Gaussian.

The image centre and the directions of the beams are bilinear: the posterior of `cx_px` and `tx` is curved.
An ellipsoid in these parameters misses more truths than stated. Spots are what the data determine. So each
beam's origin and direction are replaced by two points of its spot curve, at infinity and at 300 mm. The
truth then lies in the stated ellipsoid as often as a chi-square says.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from tests.proofs import simulate
from workbench.calibration.model.layout import Layout
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.model.stats import chi2_sf

NEAR_MM = 300.0
"""Depth of the second point of each spot curve."""
REGIONS = (0.5, 0.95, 0.99)
"""Probabilities of the stated regions."""
COVERAGE = (0.93, 0.97)
"""Of the region of 95 %."""


def joint_p(rig: Rig, sensor: FloatArray, covariance: FloatArray, truth: FloatArray) -> FloatArray:
    """(N,) probability of a truth farther from its calibration, all free parameters together.

    Args:
        rig: priors; a parameter without deviation is a constant.
        sensor: (N, S) fitted values.
        covariance: (N, S, S) their covariance.
        truth: (N, S) true values.
    """
    free = np.array([prior.sd > 0 for prior in simulate.priors(rig)])
    layout = Layout(rig.camera.lens, len(rig.lasers))
    at_fit, by_parameter = (np.asarray(part) for part in _linearised(layout, jnp.asarray(sensor)))
    at_truth = np.asarray(_points(layout, jnp.asarray(truth)))
    jacobian = by_parameter[:, free][:, :, free]
    # The transformation is one-to-one, so that the distance is that of the error brought back linearly.
    error = np.linalg.solve(jacobian, (at_truth - at_fit)[:, free, None])
    distance = np.linalg.solve(covariance[:, free][:, :, free], error)
    return np.asarray(chi2_sf((error * distance).sum(axis=(1, 2)), int(free.sum())))


def lines(p: FloatArray) -> tuple[list[str], list[str]]:
    """Lines of the table, and the misses."""
    shares = {region: float((p >= 1.0 - region).mean()) for region in REGIONS}
    text = ", ".join(
        f"{100 * region:g} %: {100 * share:.2f} +- {100 * (region * (1 - region) / len(p)) ** 0.5:.2f}"
        for region, share in shares.items()
    )
    low, high = COVERAGE
    missed = [] if low <= shares[0.95] <= high else [f"joint region of 95 %: {100 * shares[0.95]:.2f} %"]
    return [f"All parameters together, truths in the stated region of {text}"], missed


@partial(jax.jit, static_argnums=0)
def _points(layout: Layout, sensors: Array) -> Array:
    """(N, S) sensors with the rays replaced by spots at infinity and at `NEAR_MM`, px."""
    return jax.vmap(partial(_of_one, layout))(sensors)


@partial(jax.jit, static_argnums=0)
def _linearised(layout: Layout, sensors: Array) -> tuple[Array, Array]:
    """`_points`, and their derivatives (N, S, S) by the parameters."""
    one = partial(_of_one, layout)
    return jax.vmap(one)(sensors), jax.vmap(jax.jacfwd(one))(sensors)


def _of_one(layout: Layout, sensor: Array) -> Array:
    rays = sensor[layout.rays].reshape(layout.lasers, -1)
    x, y, tx, ty = rays.T
    spots = [
        jnp.asarray(part)
        for w in (0.0, 1.0 / NEAR_MM)
        for part in layout.model.project(sensor[layout.lens], x * w + tx, y * w + ty)
    ]
    return sensor.at[layout.rays].set(jnp.stack(spots, axis=1).ravel())
