"""Lines of sight of pixels: inverse of the projection, and none beyond the fold."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import opencv_pixels
from workbench.optics.equidistant import EQUIDISTANT
from workbench.optics.lens import LensModel
from workbench.optics.lens_models import LENS_MODELS
from workbench.optics.plumb_bob import PLUMB_BOB
from workbench.optics.undistort import undistort

MODELS = list(LENS_MODELS.values())


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_pixels_and_lines_of_sight_are_inverse(model: LensModel) -> None:
    rng = np.random.default_rng(5)
    lens = np.array([500.0, 320.0, 240.0, *rng.normal(0.0, 0.01, len(model.coefficients))])
    xy = rng.uniform(-0.6, 0.6, (50, 2))
    pixels = np.stack(model.project(lens, xy[:, 0], xy[:, 1]), axis=1)
    np.testing.assert_allclose(undistort(model, lens, pixels), xy, atol=1e-11)
    assert undistort(model, lens, np.empty((0, 2))).shape == (0, 2)


LENSES = {
    PLUMB_BOB: [541.3, 358.7, 235.0, 0.11, -0.07, 0.002, -0.003, 0.01],
    EQUIDISTANT: [305.2, 322.1, 236.4, 0.04, -0.03, 0.02, -0.006],
}


@pytest.mark.parametrize("model", LENSES, ids=lambda m: m.name)
def test_opencv_shows_the_lines_of_sight_at_their_pixels(model: LensModel) -> None:
    pixels = np.random.default_rng(1).uniform((0.0, 0.0), (639.0, 479.0), (200, 2))
    found = undistort(model, np.array(LENSES[model]), pixels)
    shown = opencv_pixels(model.name, LENSES[model], np.column_stack((found, np.ones(200))))
    np.testing.assert_allclose(shown, pixels, atol=1e-8)


def test_a_pixel_that_no_direction_is_seen_at_has_none() -> None:
    """With k1 = -0.5 the distorted radius is largest at r^2 = 1 / 1.5: 0.544."""
    lens = np.array([500.0, 320.0, 240.0, -0.5, 0.0, 0.0, 0.0, 0.0])
    fold = (2.0 / 3.0) ** 1.5
    pixels = np.array([[320.0 + 500.0 * fold * share, 240.0] for share in (0.0, 0.5, 0.99, 1.01)])
    found = undistort(PLUMB_BOB, lens, pixels)
    assert np.isfinite(found).all(axis=1).tolist() == [True, True, True, False]
    # One pixel without an answer leaves the others theirs.
    np.testing.assert_allclose(np.stack(PLUMB_BOB.project(lens, *found[:3].T), axis=1), pixels[:3], atol=1e-6)


def test_a_lens_without_distortion_needs_no_search() -> None:
    pixels = np.array([[320.0, 240.0], [0.0, 479.0]])
    pinhole = undistort(PLUMB_BOB, np.array([500.0, 320.0, 240.0, *np.zeros(5)]), pixels)
    np.testing.assert_allclose(pinhole, (pixels - [320.0, 240.0]) / 500.0, atol=1e-15)
    fisheye = undistort(EQUIDISTANT, np.array([500.0, 320.0, 240.0, *np.zeros(4)]), pixels)
    radius = np.hypot(*((pixels[1] - [320.0, 240.0]) / 500.0))
    assert np.hypot(*fisheye[1]) == pytest.approx(np.tan(radius), rel=1e-12)


FOLDING = {
    PLUMB_BOB: ([500.0, 320.0, 240.0, -0.5, 0.09, 0.0, 0.0, 0.0], 0.95986, 2.5),
    EQUIDISTANT: ([300.0, 320.0, 240.0, -0.6, 0.15, 0.0, 0.0], np.tan(0.93451), np.tan(np.radians(89.0))),
}


@pytest.mark.parametrize("model", FOLDING, ids=lambda m: m.name)
def test_a_pixel_shown_only_from_beyond_the_fold_has_no_line_of_sight(model: LensModel) -> None:
    """There the distorted radius grows again, beyond all that it was before the fold."""
    numbers, fold, beyond = FOLDING[model]
    lens = np.array(numbers)
    x = np.array([0.0, 0.3 * fold, 0.9 * fold, 0.99 * fold, beyond])
    pixels = np.stack(model.project(lens, x, np.zeros(5)), axis=1)
    found = undistort(model, lens, pixels)[:, 0]
    np.testing.assert_allclose(found[:4], x[:4], atol=1e-7)
    assert np.isnan(found[4])


@pytest.mark.parametrize("model", FOLDING, ids=lambda m: m.name)
def test_the_search_for_a_line_of_sight_does_not_leap_over_the_fold(model: LensModel) -> None:
    """The distorted radius first grows faster than the undistorted: the first guess lies beyond the fold."""
    lens = np.array([500.0, 320.0, 240.0, *np.zeros(len(model.coefficients))])
    lens[3:5] = 2.0, -2.0
    fold = float(model.unfolded_radius(lens[3:]))
    x = np.linspace(0.05, 0.98, 30) * fold
    pixels = np.stack(model.project(lens, x, np.zeros(30)), axis=1)
    assert pixels[-1, 0] > 320.0 + 500.0 * fold
    np.testing.assert_allclose(undistort(model, lens, pixels)[:, 0], x, atol=1e-9)
