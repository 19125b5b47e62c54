"""Names of the lenses' parameters: as OpenCV's own order has them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import opencv_pixels
from workbench.model.lens import COEFFICIENTS, PINHOLE, LensName, lens_parameters


@pytest.mark.parametrize("lens", COEFFICIENTS)
def test_parameters_are_the_pinhole_and_the_coefficients(lens: LensName) -> None:
    names = lens_parameters(lens)
    assert names == (*PINHOLE, *COEFFICIENTS[lens])
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(("name", "power"), [("k1", 3), ("k2", 5), ("k3", 7)])
@pytest.mark.parametrize("lens", COEFFICIENTS)
def test_a_radial_coefficient_moves_a_pixel_by_its_power_of_the_radius(
    lens: LensName, name: str, power: int
) -> None:
    """Of the radius of plumb_bob, of the angle of equidistant."""
    names, x = lens_parameters(lens), 0.4
    values = dict.fromkeys(names, 0.0) | {"f_px": 1.0, name: 0.1}
    without = list((values | {name: 0.0}).values())
    point = np.array([[x, 0.0, 1.0]])
    moved = opencv_pixels(lens, list(values.values()), point) - opencv_pixels(lens, without, point)
    radius = x if lens == "plumb_bob" else np.arctan(x)
    assert moved[0] == pytest.approx([0.1 * radius**power, 0.0], rel=1e-6)


@pytest.mark.parametrize(("name", "shift"), [("p1", (0.012, 0.021)), ("p2", (0.031, 0.012))])
def test_the_first_tangential_coefficient_is_that_of_y(name: str, shift: tuple[float, float]) -> None:
    """p1 moves by (2 x y, r^2 + 2 y^2), p2 by (r^2 + 2 x^2, 2 x y)."""
    values = dict.fromkeys(lens_parameters("plumb_bob"), 0.0) | {"f_px": 1.0, name: 0.1}
    found = opencv_pixels("plumb_bob", list(values.values()), np.array([[0.3, 0.2, 1.0]]))
    assert found[0] - [0.3, 0.2] == pytest.approx(shift)
