"""The model of a spot against quadrature and differences."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, profile
from tests.support.spot_models import ROUND
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR
from workbench.spots.psf import derivatives, principal_axes

SHAPE = (15, 15)


@pytest.mark.parametrize("params", [ROUND, np.append(ROUND, [[0.4]], axis=1)], ids=["upright", "sheared"])
def test_derivatives_are_those_of_the_unit_spot(params: np.ndarray) -> None:
    rows = derivatives(params, SHAPE)[0]
    step = 1e-5
    for k in range(2, params.shape[1]):
        up, down = params.copy(), params.copy()
        up[0, k] += step
        down[0, k] -= step
        difference = (derivatives(up, SHAPE)[0, FLUX] - derivatives(down, SHAPE)[0, FLUX]) / (2 * step)
        np.testing.assert_allclose(rows[k], difference, atol=1e-9)


def test_sheared_without_shear_is_upright() -> None:
    # Three quadrature nodes a pixel: exact to 1e-4 of the peak at a width of 0.6 px.
    params = np.array([[0.0, 1.0, 7.3, 6.8, np.log(0.6), np.log(0.6), 0.0]])
    upright, sheared = (derivatives(p, SHAPE)[:, FLUX] for p in (params[:, :SHEAR], params))
    np.testing.assert_allclose(sheared, upright, atol=2e-4 * upright.max())


@pytest.mark.parametrize("angle", [0.5, -0.9, 1.3])
def test_sheared_describes_a_turned_ellipse(angle: float) -> None:
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    covariance = turn @ np.diag([2.0**2, 1.2**2]) @ turn.T
    shear = covariance[0, 1] / covariance[1, 1]
    su = np.sqrt(covariance[0, 0] - shear * covariance[0, 1])
    params = np.array([[0.0, 1.0, 7.2, 6.9, np.log(su), 0.5 * np.log(covariance[1, 1]), shear]])
    drawn = profile(SHAPE, Drawn(7.2, 6.9, 1.0, 2.0, 1.2, angle))
    np.testing.assert_allclose(derivatives(params, SHAPE)[0, FLUX], drawn, atol=2e-3 * drawn.max())
    widths, axes = principal_axes(params[0])
    np.testing.assert_allclose(widths, [1.2, 2.0], rtol=1e-9)
    assert abs(axes[:, 1] @ (cos, sin)) == pytest.approx(1.0)
    assert params[0, LN_SU] < np.log(2.0)
