"""The part of an image that a scanline allows."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import draw
from workbench.model.errors import BadInputError
from workbench.spots import Failure, Scanline, find_spots
from workbench.spots.strip import distance_px, is_on, strip_of

NOISE = draw([], np.random.default_rng(8))


@pytest.mark.parametrize(
    "line", [Scanline(0, 0, 0, 0, 3), Scanline(0, 0, 1, 0, 0), Scanline(0, float("nan"), 1, 0, 3)]
)
def test_bad_scanlines_are_refused(line: Scanline) -> None:
    with pytest.raises(BadInputError, match="scanline"):
        find_spots(NOISE, scanlines=[line])


def test_a_scanline_beside_the_image_holds_no_spot() -> None:
    assert Failure.NO_SPOT in find_spots(NOISE, scanlines=[Scanline(0, 500, 1, 0, 3)]).failures


LINES = [
    Scanline(10, 25, 1, 0.1, 3),
    Scanline(30, 5, -0.2, 2, 4),
    Scanline(0, 0, 1, 1, 2.5),
    Scanline(0, 41, 3, -2, 1),
]
"""Along rows, along columns, on both diagonals."""


@pytest.mark.parametrize("line", LINES)
def test_a_strip_holds_every_pixel_of_its_band(line: Scanline) -> None:
    shape = (48, 64)
    strip = strip_of(line, shape)
    assert strip.mask is not None
    v, u = np.mgrid[: shape[0], : shape[1]].astype(float)
    # What is left of the way from a point of the line after its part along the line is taken off.
    along = np.array([line.du, line.dv]) / np.hypot(line.du, line.dv)
    way = np.stack([u - line.u0_px, v - line.v0_px], axis=2)
    distance = np.linalg.norm(way - (way @ along)[:, :, None] * along, axis=2)
    np.testing.assert_allclose(distance_px(line, u, v), distance, atol=1e-12)
    inside = np.zeros(shape, bool)
    inside[strip.at] = strip.mask
    np.testing.assert_array_equal(inside, distance <= line.half_width_px + 1.0)
    start, across = np.array([line.u0_px, line.v0_px]), line.half_width_px * along[::-1] * (1, -1)
    assert is_on(line, *(start + 7.0 * along + 0.99 * across))
    assert not is_on(line, *(start + 7.0 * along + 1.01 * across))


def test_a_band_beside_the_image_is_an_empty_strip() -> None:
    strip = strip_of(Scanline(0, 500, 1, 0, 3), (48, 64))
    assert np.zeros((48, 64))[strip.at].size == 0
