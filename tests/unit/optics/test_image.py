"""Positions in the picture, and the bend of a laser's line there."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.optics.equidistant import EQUIDISTANT
from workbench.optics.image import bend_px, in_picture, inside_px
from workbench.optics.lens import LensModel
from workbench.optics.plumb_bob import PLUMB_BOB

SIZE = (640, 480)
FISHEYE = np.array([300.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0])
TILTED = np.array([-60.0, 0.0, 0.0, 0.5])


def test_the_picture_ends_at_the_outer_edges_of_its_pixels() -> None:
    positions = np.array([[-0.5, 0.0], [-0.51, 0.0], [639.49, 479.49], [639.5, 0.0], [0.0, 479.5]])
    assert in_picture(positions, SIZE).tolist() == [True, False, True, False, False]
    assert in_picture(positions.reshape(5, 1, 2), SIZE).shape == (5, 1)


def test_a_coordinate_that_was_not_measured_lies_nowhere() -> None:
    position = np.array([np.nan, 10.0])
    assert inside_px(position, SIZE).tolist() == [False, True]
    assert not in_picture(position, SIZE)


def line(model: LensModel, lens: np.ndarray, ray: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line along u through the spot at infinity."""
    return np.stack(model.project(lens, ray[2:3], ray[3:]), axis=1)[0], np.array([-2.0, 0.0])


def test_a_pinhole_shows_a_tilted_beam_straight() -> None:
    lens = np.array([300.0, 320.0, 240.0, *np.zeros(5)])
    assert bend_px(PLUMB_BOB, lens, TILTED, 50.0, SIZE, line(PLUMB_BOB, lens, TILTED)) == 0.0


def test_the_bend_is_the_largest_distance_in_the_picture_from_the_line() -> None:
    """An ideal fisheye shows the point (x, 0.5) at 300 atan(r) / r times it; some spots leave the picture."""
    x = -np.linspace(0.0, 60.0 / 20.0, 17)
    radius = np.hypot(x, 0.5)
    u, v = 320.0 + 300.0 * np.arctan(radius) / radius * x, 240.0 + 150.0 * np.arctan(radius) / radius
    seen = (u > -0.5) & (u < 639.5)
    assert 0 < (~seen).sum() < 16
    expected = np.abs(v[seen] - v[0]).max()
    found = bend_px(EQUIDISTANT, FISHEYE, TILTED, 20.0, SIZE, line(EQUIDISTANT, FISHEYE, TILTED))
    assert found == pytest.approx(expected, rel=1e-9)
    assert found < np.abs(v - v[0]).max() - 1.0


def test_a_line_that_bends_little_counts_as_straight() -> None:
    slightly = np.array([-60.0, 0.0, 0.0, 0.01])
    found = bend_px(EQUIDISTANT, FISHEYE, slightly, 200.0, SIZE, line(EQUIDISTANT, FISHEYE, slightly))
    assert found == 0.0


def test_spots_beyond_the_fold_bend_no_line() -> None:
    """Seen from the spot at infinity, the image moves back and far off the line beyond 60 degrees."""
    lens = np.array([300.0, 320.0, 240.0, -0.3, 0.0, 0.0, 0.0])
    ray = np.array([-60.0, 0.0, 0.0, 0.2])
    at = line(EQUIDISTANT, lens, ray)
    fold = np.sqrt(float(EQUIDISTANT.unfolded_radius(lens[3:])) ** 2 - 0.2**2)
    before = bend_px(EQUIDISTANT, lens, ray, 60.0 / (0.999 * fold), SIZE, at)
    beyond = bend_px(EQUIDISTANT, lens, ray, 1.0, SIZE, at)
    assert 0.0 <= beyond <= before + 1e-9
