"""The tabulated inverse against the model that it was made from, inverted by the model's own derivatives."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from workbench.optics.equidistant import EQUIDISTANT
from workbench.optics.lens import LensModel
from workbench.optics.plumb_bob import PLUMB_BOB
from workbench.optics.rays import Ray, spot_at_inverse_depth
from workbench.optics.triangulate import DepthEstimate, MeasuredSpot, estimate_depth
from workbench.sensor import interpolation
from workbench.sensor.curves import SpotCurves

LENSES: dict[str, tuple[LensModel, np.ndarray]] = {
    "pinhole": (PLUMB_BOB, np.array([533.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0, 0.0])),
    "barrel": (PLUMB_BOB, np.array([541.0, 350.0, 221.0, -0.25, 0.08, 1e-3, -2e-3, -0.01])),
    "pincushion": (PLUMB_BOB, np.array([520.0, 300.0, 260.0, 0.3, 0.2, -1e-3, 2e-3, 0.05])),
    "ideal fisheye": (EQUIDISTANT, np.array([305.0, 322.0, 236.0, 0.0, 0.0, 0.0, 0.0])),
    "fisheye": (EQUIDISTANT, np.array([305.0, 322.0, 236.0, 0.04, -0.03, 0.02, -0.006])),
}
RAYS = np.array([[-60.0, 0.3, 0.004, -0.006], [30.0, -0.2, -0.003, 0.001], [0.2, 45.0, 0.002, 0.005]])


def model(
    kind: LensModel, lens: np.ndarray, laser: np.ndarray, position: np.ndarray, sd: np.ndarray
) -> DepthEstimate:
    def one(ray: jax.Array, at: jax.Array, sd: jax.Array) -> DepthEstimate:
        return estimate_depth(kind, lens, Ray(*ray), MeasuredSpot(at[0], at[1], sd[0], sd[1]))

    return jax.vmap(one)(jnp.asarray(RAYS[laser]), jnp.asarray(position), jnp.asarray(sd))


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("depth_mm", [100.0, 400.0, 3000.0, 30_000.0])
def test_against_the_model(name: str, depth_mm: float) -> None:
    (kind, lens), laser = LENSES[name], np.array([0, 1, 2, 1])
    rng = np.random.default_rng(4)
    unit = np.hypot(RAYS[laser, 0], RAYS[laser, 1])
    x, y = (RAYS[laser, 2 + k] + RAYS[laser, k] / depth_mm for k in (0, 1))
    undistorted = np.array([*lens[:3], *np.zeros(len(kind.coefficients))])
    position = np.stack(kind.project(undistorted, x, y), axis=1) + rng.normal(0.0, 0.05, (4, 2))
    sd = np.array([[0.05, 0.05], [0.05, 0.2], [0.1, 0.05], [0.05, np.inf]])
    found = SpotCurves(kind, lens, RAYS).invert(laser, position, 1.0 / sd)
    expected = model(kind, lens, laser, position, sd)
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
        return jnp.stack(spot_at_inverse_depth(kind, lens, Ray(*ray), w))

    (kind, lens), laser = LENSES[name], np.array([0, 1, 2, 0, 2])
    w = np.array([0.0, 1 / 100.0, 1 / 400.0, 1 / 30_000.0, -1 / 500.0])  # infinity, near, far, behind
    of_all = jax.vmap(spot, in_axes=(None, 0, 0))(jnp.asarray(lens), jnp.asarray(RAYS[laser]), jnp.asarray(w))
    derivatives = [jax.jacfwd(spot, (0, 1, 2))(lens, RAYS[n], at) for n, at in zip(laser, w, strict=True)]
    expected = np.array([np.concatenate((a, b, c[:, None]), axis=1) for a, b, c in derivatives])
    found = SpotCurves(kind, lens, RAYS)
    np.testing.assert_allclose(found.spots(laser, w), of_all, rtol=1e-10)
    scale = np.abs(expected).max(axis=(0, 1))
    if kind.polynomial_degree is None:
        # A series is as good as a part of the largest value on the whole curve, and k4's at 90 degrees is
        # 58 f: here 10 px a unit of the parameter stand for it, which no range notices.
        scale = np.maximum(scale, 10.0)
    np.testing.assert_allclose(found.gradients(laser, w) / scale, expected / scale, rtol=1e-8, atol=1e-9)


def test_no_spots() -> None:
    none = np.empty((0, 2))
    for name, columns in (("barrel", 12), ("fisheye", 11)):
        found = SpotCurves(*LENSES[name], RAYS).invert(np.empty(0, np.intp), none, none)
        assert found.dz.shape == (0, columns)


def test_a_lens_that_no_table_holds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer terms than the lens has stand for a lens with more than there are terms."""
    with pytest.raises(ValueError, match="6 terms"):
        SpotCurves(replace(PLUMB_BOB, polynomial_degree=5), LENSES["barrel"][1], RAYS)
    monkeypatch.setattr(interpolation, "SERIES_TERMS", (8, 12))
    with pytest.raises(ValueError, match="12 terms"):
        SpotCurves(*LENSES["fisheye"], RAYS)


@pytest.mark.parametrize("tilt", [0.0, 0.1, -0.4, 0.6])
def test_a_fisheye_s_spots_of_tilted_beams_are_brought_back_from_75_degrees(tilt: float) -> None:
    """Also where the beam crosses the axis, so that its spot passes the middle of the picture."""
    kind, lens = LENSES["fisheye"]
    rays = np.array([[-60.0, 0.3, tilt, 0.01], [60.0, 5.0, tilt, -0.2]])
    found = SpotCurves(kind, lens, rays)
    for laser, side in ((0, -1.0), (1, 1.0)):
        x = np.linspace(tilt, side * np.tan(np.radians(75.0)), 60)[1:]
        w = (x - tilt) / rays[laser, 0]
        index = np.full(len(w), laser)
        inverted = found.invert(index, found.spots(index, w), np.full((len(w), 2), 20.0))
        np.testing.assert_allclose(inverted.inverse_depth_per_mm, w, rtol=1e-9)
        np.testing.assert_allclose(inverted.across_sd, 0.0, atol=1e-6)


def test_a_fisheye_s_spot_beyond_infinity_has_a_negative_depth() -> None:
    kind, lens = LENSES["fisheye"]
    found, laser = SpotCurves(kind, lens, RAYS), np.array([0, 1])
    beyond = found.spots(laser, np.zeros(2)) - 5.0 * np.sign(RAYS[:2, :1]) * [1.0, 0.0]
    assert (found.invert(laser, beyond, np.full((2, 2), 20.0)).inverse_depth_per_mm < 0).all()


def test_no_depth_where_a_fisheye_folds_over() -> None:
    """theta (1 - 0.3 theta^2) grows up to 60.4 degrees, where it is 0.7027."""
    lens = np.array([300.0, 320.0, 240.0, -0.3, 0.0, 0.0, 0.0])
    fold = 1 / np.sqrt(0.9)
    seen_at = np.array([0.3, 0.6, 0.95]) * fold
    reach = 300.0 * np.array([*(seen_at * (1 - 0.3 * seen_at**2)), *(fold * 2 / 3 * np.array([1.02, 1.4]))])
    position = np.stack((320.0 - reach, np.full(5, 240.0)), axis=1)
    found = SpotCurves(EQUIDISTANT, lens, np.array([[-60.0, 0.0, 0.0, 0.0]]))
    w = found.invert(np.zeros(5, np.intp), position, np.full((5, 2), 20.0)).inverse_depth_per_mm
    np.testing.assert_allclose(w[:3], np.tan(seen_at) / 60.0, rtol=1e-9)
    assert np.isnan(w[3:]).all()


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
    found = SpotCurves(PLUMB_BOB, lens, ray).invert(np.zeros(6, np.intp), position, np.full((6, 2), 20.0))
    np.testing.assert_allclose(found.inverse_depth_per_mm[:3], seen_at / 60.0, rtol=1e-9)
    assert np.isnan(found.inverse_depth_per_mm[3:]).all()


FOLDING = {
    "plumb_bob": (PLUMB_BOB, [500.0, 320.0, 240.0, -0.5, 0.09, 0.0, 0.0, 0.0], 0.95986, 24.0),
    "equidistant": (EQUIDISTANT, [300.0, 320.0, 240.0, -0.6, 0.15, 0.0, 0.0], np.tan(0.93451), 1.05),
}


@pytest.mark.parametrize("name", FOLDING)
def test_no_depth_beyond_the_fold_where_the_spot_moves_outwards_again(name: str) -> None:
    kind, lens, fold, beyond_mm = FOLDING[name]
    found, laser = SpotCurves(kind, np.array(lens), np.array([[60.0, 0.0, 0.0, 0.0]])), np.zeros(5, np.intp)
    w = np.array([1e-5, 0.3 * fold / 60.0, 0.9 * fold / 60.0, 0.98 * fold / 60.0, 1.0 / beyond_mm])
    inverted = found.invert(laser, found.spots(laser, w), np.full((5, 2), 20.0)).inverse_depth_per_mm
    np.testing.assert_allclose(inverted[:4], w[:4], atol=1e-9)
    assert np.isnan(inverted[4])


STRONG_FISHEYE = (EQUIDISTANT, np.array([305.0, 322.0, 236.0, -0.2, 0.1, -0.05, 0.01]))


@pytest.mark.parametrize("lens", [*LENSES.values(), STRONG_FISHEYE], ids=[*LENSES, "strong fisheye"])
@pytest.mark.parametrize("tilt", [(1.5, 0.0), (1.8, 0.0), (3.0, -2.0), (-6.0, 0.0)])
def test_a_beam_may_be_tilted_much(lens: tuple[LensModel, np.ndarray], tilt: tuple[float, float]) -> None:
    kind, numbers = lens
    rays = np.array([[-60.0, 0.3, *tilt], [30.0, -0.2, *tilt], [0.2, 45.0, *tilt]])
    found, laser = SpotCurves(kind, numbers, rays), np.repeat(np.arange(3), 4)
    w = np.tile(np.array([1 / 200.0, 1 / 700.0, 1 / 3000.0, 1 / 30_000.0]), 3)
    u, v = spot_at_inverse_depth(kind, numbers[:, None], Ray(*rays[laser].T), w)
    np.testing.assert_allclose(found.spots(laser, w), np.stack((u, v), axis=1), rtol=1e-9)
    x, y = rays[laser, 2] + rays[laser, 0] * w, rays[laser, 3] + rays[laser, 1] * w
    unfolded = kind.is_unfolded(numbers, x, y)
    if kind is EQUIDISTANT:
        inverted = found.invert(laser, found.spots(laser, w), np.full((12, 2), 20.0)).inverse_depth_per_mm
        np.testing.assert_allclose(inverted[unfolded], w[unfolded], rtol=1e-8, atol=1e-12)
        assert np.isnan(inverted[~unfolded]).all()
