"""The model of a spot against quadrature and differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from tests.unit.spots.draw import Drawn, profile
from workbench.spots.gaussian import FLUX, LN_SU, SHEAR, Sheared, Upright, axis_profiles, principal_axes

SHAPE = (15, 15)
ROUND = np.array([[0.0, 1.0, 7.3, 6.8, np.log(1.1), np.log(1.7)]])


@pytest.mark.parametrize("sd", [0.3, 0.6, 1.5, 4.0])
def test_share_of_a_pixel_is_the_integral_of_the_density(sd: float) -> None:
    shares = axis_profiles(np.array(3.2), np.log(np.array(sd)), 8)[0]
    for pixel, share in enumerate(shares):
        density = lambda x: np.exp(-0.5 * ((x - 3.2) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))  # noqa: E731
        assert share == pytest.approx(quad(density, pixel - 0.5, pixel + 0.5, epsabs=1e-13)[0], abs=1e-11)


@pytest.mark.parametrize(
    ("model", "params"),
    [
        (Upright, ROUND),
        (Sheared, np.append(ROUND, [[0.4]], axis=1)),
    ],
)
def test_derivatives_are_those_of_the_unit_spot(
    model: type[Upright] | type[Sheared], params: np.ndarray
) -> None:
    rows = model(params, SHAPE).rows()[0]
    step = 1e-5
    for k in range(2, params.shape[1]):
        up, down = params.copy(), params.copy()
        up[0, k] += step
        down[0, k] -= step
        difference = (model(up, SHAPE).unit - model(down, SHAPE).unit).ravel() / (2 * step)
        np.testing.assert_allclose(rows[k], difference, atol=1e-9)
    np.testing.assert_array_equal(rows[FLUX], model(params, SHAPE).unit.ravel())


def test_separable_sums_equal_the_written_out_ones() -> None:
    rng = np.random.default_rng(1)
    params = np.vstack([ROUND, ROUND + 0.1])
    design = Upright(params, (11, 13))
    rows = design.rows()
    weight = rng.uniform(0.0, 1.0, (2, 11, 13))
    flat = weight.reshape(2, 1, -1)
    np.testing.assert_allclose(
        design.information(weight), np.asarray((rows * flat) @ rows.transpose(0, 2, 1)), atol=1e-12
    )
    np.testing.assert_allclose(design.gradient(weight), (rows * flat).sum(axis=2), atol=1e-12)
    cov = np.asarray(np.linalg.inv(design.information(weight)), np.float64)
    expected = np.einsum("nip,nij,njp->np", rows, cov, rows).reshape(weight.shape)
    np.testing.assert_allclose(design.leverage(cov), expected, atol=1e-9)


def test_sheared_without_shear_is_upright() -> None:
    # Three quadrature nodes a pixel: exact to 1e-4 of the peak at a width of 0.6 px.
    params = np.array([[0.0, 1.0, 7.3, 6.8, np.log(0.6), np.log(0.6), 0.0]])
    upright, sheared = Upright(params[:, :SHEAR], SHAPE), Sheared(params, SHAPE)
    np.testing.assert_allclose(sheared.unit, upright.unit, atol=2e-4 * upright.unit.max())


@pytest.mark.parametrize("angle", [0.5, -0.9, 1.3])
def test_sheared_describes_a_turned_ellipse(angle: float) -> None:
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    covariance = turn @ np.diag([2.0**2, 1.2**2]) @ turn.T
    shear = covariance[0, 1] / covariance[1, 1]
    su = np.sqrt(covariance[0, 0] - shear * covariance[0, 1])
    params = np.array([[0.0, 1.0, 7.2, 6.9, np.log(su), 0.5 * np.log(covariance[1, 1]), shear]])
    drawn = profile(SHAPE, Drawn(7.2, 6.9, 1.0, 2.0, 1.2, angle))
    np.testing.assert_allclose(Sheared(params, SHAPE).unit[0], drawn, atol=2e-3 * drawn.max())
    widths, axes = principal_axes(params[0])
    np.testing.assert_allclose(widths, [1.2, 2.0], rtol=1e-9)
    assert abs(axes[:, 1] @ (cos, sin)) == pytest.approx(1.0)
    assert params[0, LN_SU] < np.log(2.0)
