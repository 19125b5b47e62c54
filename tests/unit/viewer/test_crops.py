"""Crops around spots: the right pixels, what the fit leaves, and what belongs to earlier captures."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.viewer_stream import (
    COLORS,
    HERE,
    a_spot,
    bright_spot,
    drawn_frame,
    logged,
    packed,
)
from tests.viewer.readback import Contents
from workbench.model.arrays import FloatArray, Image
from workbench.model.spot import Failure, Spot
from workbench.viewer import crops
from workbench.viewer.crops import LABEL_PX, MIDDLE, SIDE_PX, Crop, Crops, cell_corner, mosaic_size
from workbench.viewer.entities import RED
from workbench.viewer.stream import Moment, Stream

HALF = SIDE_PX // 2
LASERS = list(COLORS)
LABELS, STRIPS = "Points2D:labels", "LineStrips2D:strips"


def taken(folder: Path, on: Image, off: Image | None, *spots: Spot, **expected: FloatArray) -> Contents:
    """One capture, logged."""
    return logged(folder, lambda stream: Crops(stream, COLORS).take(on, off, spots, expected))


def picture(contents: Contents) -> Image:
    _, png = contents.values("/crops/image", "EncodedImage:blob")[-1]
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image.astype(np.uint8)


def squares(image: Image, laser: str) -> tuple[Image, Image]:
    """Square of the signal and of the residual of a laser."""
    column, row = cell_corner(LASERS.index(laser), len(LASERS))
    rows = slice(row, row + SIDE_PX)
    second = column + SIDE_PX + crops.GAP_PX
    return image[rows, column : column + SIDE_PX], image[rows, second : second + SIDE_PX]


def labels(contents: Contents) -> dict[str, str]:
    """Text above each laser's squares, as shown last."""
    texts = contents.values("/crops/labels", LABELS)[-1][1]
    return dict(zip(LASERS, texts, strict=True))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("u_px", "v_px"), [(50.2, 40.4), (3.0, 40.0), (97.0, 2.0), (50.0, 78.4), (0.0, 0.0), (99.0, 79.0)]
)
def test_a_square_is_lit_minus_dark_about_the_spot_and_black_beyond_the_frame(
    tmp_path: Path, seed: int, u_px: float, v_px: float
) -> None:
    random = np.random.default_rng(seed)
    on, off = (random.integers(0, 256, (80, 100)).astype(np.uint8) for _ in range(2))
    difference = np.pad(on.astype(float) - off, HALF)
    row, column = round(v_px), round(u_px)
    expected = np.clip(difference[row : row + SIDE_PX, column : column + SIDE_PX], 0, None)
    shown, _ = squares(picture(taken(tmp_path, on, off, a_spot("L2", u_px, v_px))), "L2")
    np.testing.assert_allclose(shown, 255 * np.sqrt(expected / expected.max()), atol=1.0)


def test_without_a_dark_frame_the_square_is_the_lit_one(tmp_path: Path) -> None:
    on = np.zeros((80, 100), np.uint8)
    on[30, 60] = 200
    shown, _ = squares(picture(taken(tmp_path, on, None, a_spot("L1", 60.0, 30.0))), "L1")
    assert np.argwhere(shown == 255).tolist() == [[HALF, HALF]]


@pytest.mark.parametrize("width_px", [0.8, 1.5, 3.0])
@pytest.mark.parametrize(("u_px", "v_px"), [(200.0, 100.0), (200.37, 99.71), (1.2, 239.0)])
def test_an_exact_profile_leaves_a_grey_residual(
    tmp_path: Path, width_px: float, u_px: float, v_px: float
) -> None:
    """Rounding of a frame of 16 bits is far below a grey level."""
    spot = bright_spot("L3", u_px, v_px, 30_000.0, width_px)
    on, off = drawn_frame([spot], 900.0, (240, 320)), drawn_frame([], 900.0, (240, 320))
    _, residual = squares(picture(taken(tmp_path, on, off, spot)), "L3")
    inside = residual[:, HALF - 1 :] if u_px < HALF else residual
    inside = inside[: HALF + 1] if v_px > 240 - HALF else inside
    assert set(np.unique(inside)) <= {MIDDLE - 1, MIDDLE}


def test_neighbouring_spots_are_subtracted_too(tmp_path: Path) -> None:
    spots = [bright_spot("L3", 200.0, 100.0, 30_000.0), bright_spot(None, 208.5, 94.0, 20_000.0)]
    on, off = drawn_frame(spots, 900.0, (240, 320)), drawn_frame([], 900.0, (240, 320))
    _, residual = squares(picture(taken(tmp_path, on, off, *spots)), "L3")
    assert set(np.unique(residual)) <= {MIDDLE - 1, MIDDLE}


def test_a_second_peak_that_the_fit_ignores_is_bright_in_the_residual(tmp_path: Path) -> None:
    spot, ghost = bright_spot("L3", 200.0, 100.0, 3000.0), bright_spot(None, 208.0, 94.0, 600.0)
    on, off = drawn_frame([spot, ghost], 20.0, (240, 320)), drawn_frame([], 20.0, (240, 320))
    _, residual = squares(picture(taken(tmp_path, on, off, spot)), "L3")
    row, column = np.unravel_index(residual.argmax(), residual.shape)
    assert (int(row), int(column)) == (HALF - 6, HALF + 8)
    assert residual.max() > 200
    assert abs(int(residual[HALF, HALF]) - MIDDLE) <= 2


def test_the_cross_is_about_the_centre_and_leaves_it_free() -> None:
    spot = a_spot("L1", 100.25, 50.5)
    distances = np.hypot(*(np.concatenate(crops.cross(spot)) - np.array([100.25, 50.5])).T)
    assert distances.min() == pytest.approx(crops.CROSS_PX[0])


def test_ellipses_have_one_and_ten_standard_deviations() -> None:
    spot = replace(a_spot("L1", 100.25, 50.5), u_sd_px=0.5, v_sd_px=0.3)
    for ellipse, sd in zip(crops.ellipses(spot), (1.0, 10.0), strict=True):
        np.testing.assert_allclose(ellipse.max(axis=0) - [100.25, 50.5], [0.5 * sd, 0.3 * sd])
        np.testing.assert_allclose(ellipse.min(axis=0) - [100.25, 50.5], [-0.5 * sd, -0.3 * sd])


@pytest.mark.parametrize("sd_px", [1e-4, 0.3, 50.0])
def test_outlines_end_at_the_edge_of_their_square(tmp_path: Path, sd_px: float) -> None:
    on = np.full((480, 640), 50, np.uint16)
    spot = replace(a_spot("L1", 300.0, 200.0), u_sd_px=sd_px, v_sd_px=sd_px)
    ((_, strips),) = taken(tmp_path, on, on, spot).values("/crops/ellipses", STRIPS)
    column, row = cell_corner(0, len(LASERS))
    points = np.concatenate(strips) - np.array([column, row])
    assert points.min() >= 0.0
    assert points.max() <= SIDE_PX
    assert len(strips) == 2


def test_marks_are_drawn_at_the_square_of_their_laser(tmp_path: Path) -> None:
    on = np.full((480, 640), 50, np.uint16)
    contents = taken(tmp_path, on, on, a_spot("L4", 300.25, 200.0))
    ((_, strips),) = contents.values("/crops/centres", STRIPS)
    column, row = cell_corner(LASERS.index("L4"), len(LASERS))
    centre = (column + HALF + 0.25 + 0.5, row + HALF + 0.5)
    np.testing.assert_allclose(np.mean(np.concatenate(strips[:4]), axis=0), centre, atol=1e-4)


def test_a_crop_is_earlier_after_the_next_laser_and_gone_at_the_next_placement(tmp_path: Path) -> None:
    on = drawn_frame([bright_spot("L1", 100.0, 100.0, 3000.0)], 10.0)

    def log(stream: Stream) -> None:
        crop = Crops(stream, COLORS)
        for n, spot in enumerate((a_spot("L1", 100.0, 100.0), a_spot("L2", 300.0, 100.0)), start=1):
            stream.at(Moment(n, 1, HERE.time_ns + n))
            crop.take(on, None, [spot], {})
        stream.at(Moment(3, 1, HERE.time_ns + 3))
        crop.log_none()

    contents = logged(tmp_path, log)
    first, second, third = (
        dict(zip(LASERS, texts, strict=True)) for _, texts in contents.values("/crops/labels", LABELS)
    )
    assert "earlier" not in first["L1"]
    assert "earlier" in second["L1"]
    assert "earlier" not in second["L2"]
    assert third == {laser: laser for laser in LASERS}
    pictures = [
        cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
        for _, png in contents.values("/crops/image", "EncodedImage:blob")
    ]
    kept = [squares(np.asarray(image, np.uint8), "L1")[0].max() for image in pictures]
    assert kept == [255, 255, 0]


def test_a_repeat_of_the_same_laser_replaces_its_crop(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        crop = Crops(stream, COLORS)
        for peak in (1000.0, 2000.0):
            spot = bright_spot("L1", 100.0, 100.0, peak)
            crop.take(drawn_frame([spot], 10.0), None, [spot], {})

    assert labels(logged(tmp_path, log))["L1"] == "L1 peak 2000 DN"


def test_a_saturated_spot_has_a_red_label(tmp_path: Path) -> None:
    on = np.full((480, 640), 50, np.uint16)
    spots = (a_spot("L1", 100.0, 240.0, Failure.SATURATED), a_spot("L2", 300.0, 240.0, Failure.MERGED))
    contents = taken(tmp_path, on, None, *spots)
    ((_, colors),) = contents.values("/crops/labels", "Points2D:colors")
    assert colors == [packed(RED), *(packed(COLORS[laser]) for laser in LASERS[1:])]
    assert "saturated" in labels(contents)["L1"]
    assert "merged" in labels(contents)["L2"]


def test_a_laser_without_a_spot_shows_the_place_where_it_was_expected(tmp_path: Path) -> None:
    on = np.zeros((480, 640), np.uint8)
    on[110, 205] = 90
    contents = taken(tmp_path, on, None, L2=np.array([200.0, 100.0]), L3=np.array([np.nan, 1.0]))
    shown, residual = squares(picture(contents), "L2")
    assert np.argwhere(shown > 0).tolist() == [[HALF + 10, HALF + 5]]
    assert (residual == MIDDLE).all()
    assert labels(contents) == {"L1": "L1", "L2": "L2 no spot", "L3": "L3", "L4": "L4"}
    assert contents.values("/crops/centres", STRIPS) == [(1, [])]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_reflection_beside_the_spot_of_the_only_laser_is_in_its_square(tmp_path: Path, seed: int) -> None:
    """Far from where the spot was expected."""
    du, dv = np.random.default_rng(seed).integers(6, 15, 2).tolist()
    pair = [bright_spot(None, 200.0 + du, 100.0 + dv, 20_000.0), bright_spot(None, 200.0, 100.0, 30_000.0)]
    on, off = drawn_frame(pair, 900.0, (240, 320)), drawn_frame([], 900.0, (240, 320))
    contents = taken(tmp_path, on, off, *pair, L2=np.array([80.0, 40.0]))
    shown, residual = squares(picture(contents), "L2")
    assert shown[HALF, HALF] == 255
    assert shown[HALF + dv, HALF + du] == pytest.approx(255 * np.sqrt(2 / 3), abs=2)
    assert set(np.unique(residual)) <= {MIDDLE - 1, MIDDLE}
    assert labels(contents)["L2"] == "L2 2 spots, not assigned"
    ((_, colors),) = contents.values("/crops/labels", "Points2D:colors")
    assert colors[LASERS.index("L2")] == packed(RED)
    assert contents.values("/crops/centres", STRIPS) == [(1, [])]


def test_spots_of_no_laser_are_not_those_of_one_of_several(tmp_path: Path) -> None:
    on = np.full((480, 640), 9, np.uint8)
    where = np.array([200.0, 100.0])
    found = labels(taken(tmp_path, on, None, a_spot(None, 50.0), L1=where, L2=where + 50.0))
    assert (found["L1"], found["L2"]) == ("L1 no spot", "L2 no spot")


@pytest.mark.parametrize("u_px", [-900.0, -60.0, 300.0, 700.0, 5000.0])
@pytest.mark.parametrize("v_px", [-900.0, -60.0, 520.0, 5000.0])
def test_a_place_expected_outside_the_frame_is_black(tmp_path: Path, u_px: float, v_px: float) -> None:
    on = np.full((480, 640), 9, np.uint8)
    shown, _ = squares(picture(taken(tmp_path, on, None, L2=np.array([u_px, v_px]))), "L2")
    assert not shown.any()


def test_spots_of_no_laser_of_the_rig_have_no_crop(tmp_path: Path) -> None:
    on = np.full((480, 640), 9, np.uint8)
    contents = taken(tmp_path, on, None, a_spot(None, 50.0), a_spot("of another rig", 90.0))
    assert labels(contents) == {laser: laser for laser in LASERS}


@pytest.mark.parametrize("lasers", [1, 2, 3, 4, 5, 8])
def test_squares_and_their_labels_are_in_the_picture_and_do_not_overlap(lasers: int) -> None:
    width, height = mosaic_size(lasers)
    taken_by = np.zeros((height, width), int)
    for n in range(lasers):
        column, row = cell_corner(n, lasers)
        assert row - LABEL_PX >= 0
        for left in (column, column + SIDE_PX + crops.GAP_PX):
            assert left >= 0
            assert left + SIDE_PX <= width
            assert row + SIDE_PX <= height
            taken_by[row : row + SIDE_PX, left : left + SIDE_PX] += 1
        taken_by[row - LABEL_PX : row, column : column + 2 * SIDE_PX + crops.GAP_PX] += 1
    assert taken_by.max() == 1
    assert crops.mosaic([None] * lasers).shape == (height, width)


@pytest.mark.parametrize("lasers", [1, 2, 4, 5, 8])
def test_every_laser_has_the_cell_of_its_own_crop(lasers: int) -> None:
    """Crop n is a single lit pixel at (n, 2 n) of its square."""
    drawn = []
    for n in range(lasers):
        signal = np.zeros((SIDE_PX, SIDE_PX))
        signal[2 * n, n] = 10.0
        drawn.append(Crop(signal, 0, 0, None))
    lit = {(int(u), int(v)) for v, u in np.argwhere(crops.mosaic(drawn) == 255)}
    corners = [cell_corner(n, lasers) for n in range(lasers)]
    assert lit == {(column + n, row + 2 * n) for n, (column, row) in enumerate(corners)}
    assert all(a != b for a, b in combinations(corners, 2))
