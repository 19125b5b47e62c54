"""The tabulated inverse against the model that it was made from, inverted by the model's own derivatives."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from workbench.optics.lens import Lens
from workbench.optics.rays import Ray, spot_at_inverse_depth
from workbench.optics.triangulate import DepthEstimate, MeasuredSpot, estimate_depth
from workbench.sensor import curves
from workbench.sensor.curves import SpotCurves

LENSES = {
    "pinhole": np.array([533.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0, 0.0]),
    "barrel": np.array([541.0, 350.0, 221.0, -0.25, 0.08, 1e-3, -2e-3, -0.01]),
    "pincushion": np.array([520.0, 300.0, 260.0, 0.3, 0.2, -1e-3, 2e-3, 0.05]),
}
RAYS = np.array([[-60.0, 0.3, 0.004, -0.006], [30.0, -0.2, -0.003, 0.001], [0.2, 45.0, 0.002, 0.005]])


def model(lens: np.ndarray, laser: np.ndarray, position: np.ndarray, sd: np.ndarray) -> DepthEstimate:
    def one(ray: jax.Array, at: jax.Array, sd: jax.Array) -> DepthEstimate:
        return estimate_depth(Lens(*lens), Ray(*ray), MeasuredSpot(at[0], at[1], sd[0], sd[1]))

    return jax.vmap(one)(jnp.asarray(RAYS[laser]), jnp.asarray(position), jnp.asarray(sd))


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("depth_mm", [100.0, 400.0, 3000.0, 30_000.0])
def test_against_the_model(name: str, depth_mm: float) -> None:
    lens, laser = LENSES[name], np.array([0, 1, 2, 1])
    rng = np.random.default_rng(4)
    unit = np.hypot(RAYS[laser, 0], RAYS[laser, 1])
    x, y = (RAYS[laser, 2 + k] + RAYS[laser, k] / depth_mm for k in (0, 1))
    position = lens[1:3] + lens[0] * np.stack((x, y), axis=1) + rng.normal(0.0, 0.05, (4, 2))
    sd = np.array([[0.05, 0.05], [0.05, 0.2], [0.1, 0.05], [0.05, np.inf]])
    found = SpotCurves(lens, RAYS).invert(laser, position, 1.0 / sd)
    expected = model(lens, laser, position, sd)
    w = np.asarray(expected.inverse_depth_per_mm)
    # 1e-9 of the range: some 1e-10 of the inverse depth at which the spot stands 45 degrees off the axis.
    np.testing.assert_allclose(found.inverse_depth_per_mm, w, rtol=1e-9, atol=1e-13 / unit.min())
    np.testing.assert_allclose(found.z_sd_of_spot_mm, expected.z_sd_of_spot_mm, rtol=1e-7)
    np.testing.assert_allclose(found.across_sd, expected.across_sd, atol=1e-7)
    for ours, lens_part, ray_part in (
        (found.dz, expected.dz_dlens, expected.dz_dray),
        (found.dacross, expected.dacross_dlens, expected.dacross_dray),
    ):
        theirs = np.concatenate((lens_part, ray_part), axis=1)
        np.testing.assert_allclose(ours, theirs, rtol=1e-7, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("name", LENSES)
def test_spots_and_their_derivatives_are_those_of_the_model(name: str) -> None:
    def spot(lens: jax.Array, ray: jax.Array, w: jax.Array) -> jax.Array:
        return jnp.stack(spot_at_inverse_depth(Lens(*lens), Ray(*ray), w))

    lens, laser = LENSES[name], np.array([0, 1, 2, 0, 2])
    w = np.array([0.0, 1 / 100.0, 1 / 400.0, 1 / 30_000.0, -1 / 500.0])  # infinity, near, far, behind
    of_all = jax.vmap(spot, in_axes=(None, 0, 0))(jnp.asarray(lens), jnp.asarray(RAYS[laser]), jnp.asarray(w))
    derivatives = [jax.jacfwd(spot, (0, 1, 2))(lens, RAYS[n], at) for n, at in zip(laser, w, strict=True)]
    expected = np.array([np.concatenate((a, b, c[:, None]), axis=1) for a, b, c in derivatives])
    found = SpotCurves(lens, RAYS)
    np.testing.assert_allclose(found.spots(laser, w), of_all, rtol=1e-10)
    scale = np.abs(expected).max(axis=(0, 1))
    np.testing.assert_allclose(found.gradients(laser, w) / scale, expected / scale, rtol=1e-8, atol=1e-9)


def test_no_spots() -> None:
    none = np.empty((0, 2))
    found = SpotCurves(LENSES["barrel"], RAYS).invert(np.empty(0, np.intp), none, none)
    assert found.dz.shape == (0, 12)


def test_a_model_that_is_no_polynomial_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer terms than the lens has stand for a lens with more than there are terms."""
    monkeypatch.setattr(curves, "TERMS", 6)
    with pytest.raises(ValueError, match="no polynomial of degree 5"):
        SpotCurves(LENSES["barrel"], RAYS)


def test_no_depth_where_the_lens_model_folds_over() -> None:
    """r (1 - 0.45 r^2) grows up to r = 0.861, where it is 0.574: no depth puts a spot farther out."""
    lens = np.array([530.0, 320.0, 240.0, -0.45, 0.0, 0.0, 0.0, 0.0])
    fold = np.sqrt(1.0 / (3 * 0.45))
    seen_at = np.array([0.3, 0.6, 0.9]) * fold
    reach = 530.0 * np.array(
        [*(seen_at * (1 - 0.45 * seen_at**2)), *(fold * 2 / 3 * np.array([1.02, 1.1, 1.4]))]
    )
    position = np.stack((320.0 - reach, np.full(6, 240.0)), axis=1)
    ray = np.array([[-60.0, 0.0, 0.0, 0.0]])
    found = SpotCurves(lens, ray).invert(np.zeros(6, np.intp), position, np.full((6, 2), 20.0))
    np.testing.assert_allclose(found.inverse_depth_per_mm[:3], seen_at / 60.0, rtol=1e-9)
    assert np.isnan(found.inverse_depth_per_mm[3:]).all()
