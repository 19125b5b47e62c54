"""Corners drawn by their own formula: errors as stated, and what is no corner."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from workbench.corners.subpixel import FLOOR_SD_PX, Saddles, fit_saddles
from workbench.model.arrays import FloatArray

TILE, ROWS, COLUMNS = 31, 6, 10
PAPER_DN, INK_DN = 180.0, 20.0


def corners(seed: int) -> FloatArray:
    """(n, 2) one in every tile, somewhere in the middle pixel."""
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    middle = np.column_stack([column, row]) * TILE + TILE // 2
    return np.asarray(middle + rng.uniform(-0.5, 0.5, middle.shape))


def board(at: FloatArray, angles_deg: tuple[float, float] = (10.0, 98.0), blur_px: float = 0.9) -> FloatArray:
    """An image of tiles with a corner each; the angles are those of the edges' normals."""
    image = np.zeros((ROWS * TILE, COLUMNS * TILE))
    for n, (u, v) in enumerate(at):
        row, column = divmod(n, COLUMNS)
        y, x = np.mgrid[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE]
        edges = []
        for angle in np.radians(angles_deg):
            d = (x - u) * np.cos(angle) + (y - v) * np.sin(angle)
            edges.append(erf(d / (np.sqrt(2) * blur_px)))
        image[y, x] = 0.5 * (PAPER_DN + INK_DN) + 0.5 * (PAPER_DN - INK_DN) * edges[0] * edges[1]
    return image


def fitted(image: FloatArray, at: FloatArray, px_per_mm: FloatArray | None = None) -> Saddles:
    scale = np.eye(2) if px_per_mm is None else px_per_mm
    return fit_saddles(image, np.rint(at), np.tile(scale, (len(at), 1, 1)), 20.0, 10.0)


@pytest.mark.parametrize("angles_deg", [(0.0, 90.0), (10.0, 98.0), (-30.0, 75.0)])
@pytest.mark.parametrize("blur_px", [0.6, 1.5])
def test_a_clean_corner_is_found_where_it_is(angles_deg: tuple[float, float], blur_px: float) -> None:
    at = corners(1)
    image = board(at, angles_deg, blur_px)
    # Against the noise of rounding alone half of the corners would be bad ones.
    found = fitted(image + np.random.default_rng(1).normal(0.0, 0.01, image.shape), at)
    assert found.good.all()
    np.testing.assert_allclose(found.position_px, at, atol=1e-3)
    np.testing.assert_allclose(found.sd_px, FLOOR_SD_PX, rtol=1e-2)


@pytest.mark.parametrize("noise_dn", [3.0, 8.0])
def test_errors_of_corners_in_noise_are_as_stated(noise_dn: float) -> None:
    z = []
    for seed in (1, 2, 3):
        at = corners(seed)
        image = board(at) + np.random.default_rng(seed).normal(0.0, noise_dn, (ROWS * TILE, COLUMNS * TILE))
        found = fitted(image, at)
        assert found.good.mean() > 0.95
        # The model is exact here: what it leaves out of a lens's picture is no part of the error.
        sd = np.sqrt(found.sd_px[found.good] ** 2 - FLOOR_SD_PX**2)
        z.append((found.position_px - at)[found.good] / sd)
    squares = np.concatenate(z) ** 2
    assert squares.mean() == pytest.approx(1.0, abs=0.1 + 4 * np.sqrt(2 / squares.size))


def test_a_deviation_falls_with_the_contrast_over_the_noise() -> None:
    at = corners(4)
    rng = np.random.default_rng(4)
    noise = rng.normal(0.0, 1.0, (ROWS * TILE, COLUMNS * TILE))
    sds = []
    for sd in (4.0, 8.0):
        stated = fitted(board(at) + sd * noise, at).sd_px
        sds.append(np.sqrt(np.nanmean(stated**2 - FLOOR_SD_PX**2)))
    assert sds[1] / sds[0] == pytest.approx(2.0, rel=0.1)


def test_what_is_no_corner_is_not_good_and_leaves_the_others_alone() -> None:
    at = corners(5)
    image = board(at)
    image += np.random.default_rng(5).normal(0.0, 2.0, image.shape)
    flat, edge, stain = 3, 17, 41
    for n in (flat, edge):
        row, column = divmod(n, COLUMNS)
        image[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE] = PAPER_DN
    row, column = divmod(edge, COLUMNS)
    image[row * TILE : (row + 1) * TILE, column * TILE : column * TILE + TILE // 2] = INK_DN
    u, v = np.rint(at[stain]).astype(int)
    image[v - 1 : v + 8, u + 1 : u + 8] = INK_DN
    found = fitted(image, at)
    assert not found.good[[flat, edge, stain]].any()
    others = np.delete(np.arange(len(at)), [flat, edge, stain])
    assert found.good[others].mean() > 0.95
    kept = others[found.good[others]]
    assert np.abs((found.position_px - at)[kept] / found.sd_px[kept]).max() < 5.0


@pytest.mark.parametrize(("distance_px", "good"), [(7, True), (5, False)])
def test_a_window_cut_by_the_border_is_not_good(distance_px: int, good: bool) -> None:
    at = corners(6)
    first = TILE // 2 - distance_px
    found = fitted(board(at)[:, first:], at - [first, 0])
    assert found.good.reshape(ROWS, COLUMNS)[:, 0].tolist() == [good] * ROWS
    assert found.good.reshape(ROWS, COLUMNS)[:, 1:].all()


def test_squares_too_small_for_the_gap_beside_their_markers_are_not_good() -> None:
    """A gap of 2.5 mm is 2 px at 0.8 px a mm: 0.3 px are left beside the blur of the marker."""
    at = corners(7)
    image = board(at)
    for scale, good in ((0.8, False), (1.2, True)):
        px_per_mm = np.tile(scale * np.eye(2), (len(at), 1, 1))
        assert fit_saddles(image, np.rint(at), px_per_mm, 20.0, 2.5).good.any() == good
