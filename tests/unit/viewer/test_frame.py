"""Frames and their marks: bytes as stored, contrast by the room light, labels beside the spots."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.viewer_stream import COLORS, HERE, a_range, a_spot, logged, packed, png_of
from workbench.model.arrays import Image
from workbench.model.spot import Failure, Spot
from workbench.viewer import frame
from workbench.viewer.frame import LABEL_DISTANCE_PX, LEADER_PX, PREDICTED_PX, label, label_columns
from workbench.viewer.stream import Moment, Stream

SCALARS, STRIPS = "Scalars:scalars", "LineStrips2D:strips"
COLUMNS = st.lists(st.floats(0.0, 2000.0), min_size=1, max_size=12).map(sorted)


def grey(values: np.ndarray, full_scale: int) -> Image:
    """Frame as a camera with this largest value delivers it."""
    return values.astype(np.uint8) if full_scale <= 255 else values.astype(np.uint16)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_frame_is_logged_as_stored(tmp_path: Path, seed: int, bits: int) -> None:
    values = np.random.default_rng(seed).integers(0, 2**bits, (48, 64))
    pixels = grey(values, 2**bits - 1)
    png = png_of(pixels)
    contents = logged(tmp_path, lambda stream: frame.log_frame(stream, png, 0.0, 2**bits - 1))
    assert contents.values("/frame/image", "EncodedDepthImage:blob") == [(1, png)]


@pytest.mark.parametrize(
    ("ambient_dn", "full_scale", "white"),
    [
        (60, 255, 1.0),
        (20, 255, 20 / 255 / 0.12),
        (0, 255, 0.25),
        (5, 255, 0.25),
        (None, 255, 1.0),
        (200, 4095, 200 / 0.12),
        (0, 4095, 0.25 * 4095),
        (2000, 4095, 4095.0),
        (None, 65535, 65535.0),
    ],
)
def test_white_is_a_multiple_of_the_room_light(
    tmp_path: Path, ambient_dn: int | None, full_scale: int, white: float
) -> None:
    """8 bits are scaled to 0..1 by the viewer, 16 bits are not."""
    png = png_of(grey(np.zeros((6, 8)), full_scale))
    contents = logged(tmp_path, lambda stream: frame.log_frame(stream, png, ambient_dn, full_scale))
    ((_, ((low, high),)),) = contents.values("/frame/image", "EncodedDepthImage:depth_range")
    assert low == 0.0
    assert high == pytest.approx(white)


@given(columns=COLUMNS)
def test_labels_are_apart_in_the_order_of_their_spots_and_near_them(columns: list[float]) -> None:
    """Of n labels, label i is at most (n - 1 - i) / 2 distances left of its spot, and i / 2 right of it."""
    labels = label_columns(columns)
    assert len(labels) == len(columns)
    for left, right in pairwise(labels):
        assert right - left >= LABEL_DISTANCE_PX - 1e-6
    for i, (column, place) in enumerate(zip(columns, labels, strict=True)):
        left, right = (LABEL_DISTANCE_PX / 2 * n for n in (len(columns) - 1 - i, i))
        assert -left - 1e-6 <= place - column <= right + 1e-6


@given(columns=COLUMNS)
def test_labels_of_spots_that_are_apart_are_straight_below(columns: list[float]) -> None:
    apart = [column + (LABEL_DISTANCE_PX + 1.0) * i for i, column in enumerate(columns)]
    assert label_columns(apart) == pytest.approx(apart)


@given(columns=COLUMNS)
def test_labels_are_spread_about_the_middle_of_their_spots(columns: list[float]) -> None:
    assert np.mean(label_columns(columns)) == pytest.approx(np.mean(columns), abs=1e-6)


def test_a_frame_without_spots_needs_no_labels() -> None:
    assert label_columns([]) == []


SPOTS = (a_spot("L2", 310.0), a_spot("L1", 300.25, 241.0), a_spot(None, 500.0, 100.0, Failure.MERGED))


def test_leaders_do_not_touch_their_spots_and_end_at_the_labels(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: frame.log_spots(stream, SPOTS, COLORS, 480))
    ((_, leaders),) = contents.values("/frame/spots", STRIPS)
    ((_, places),) = contents.values("/frame/spots", "Points2D:positions")
    ordered = sorted(SPOTS, key=lambda spot: spot.u_px)
    for leader, place, spot in zip(leaders, places, ordered, strict=True):
        centre = np.array([spot.u_px, spot.v_px]) + 0.5
        assert np.hypot(*(np.array(leader) - centre).T).min() == pytest.approx(LEADER_PX[0], abs=1e-3)
        assert leader[-1] == place
    ((_, texts),) = contents.values("/frame/spots", "Points2D:labels")
    assert texts == ["L1", "L2", "? (merged)"]
    for entity, component in (("/frame/spots", "LineStrips2D:colors"), ("/frame/spots", "Points2D:colors")):
        ((_, colors),) = contents.values(entity, component)
        assert colors[:2] == [packed(COLORS["L1"]), packed(COLORS["L2"])]


def test_the_label_of_a_spot_near_the_lower_edge_is_above_it() -> None:
    near, far = LEADER_PX
    for v_px in (0.0, 200.0, 420.0, 440.0, 479.0):
        points = frame.leader(a_spot("L1", 300.0, v_px), 310.0, 480)
        way = -1 if v_px > 420.0 else 1
        assert points == [
            (300.0, v_px + way * near),
            (300.0, v_px + way * far / 2),
            (310.0, v_px + way * far),
        ]
        assert 0 <= points[-1][1] < 480


def test_the_outlines_of_expected_spots_are_an_entity_of_their_own(tmp_path: Path) -> None:
    outline = np.array([(10.0, 20.0), (12.0, 24.0)])
    contents = logged(tmp_path, lambda stream: frame.log_predicted_ellipses(stream, {"L2": outline}, COLORS))
    ((_, (strip,)),) = contents.values("/frame/predicted_ellipses", STRIPS)
    np.testing.assert_allclose(strip, outline + 0.5)


@pytest.mark.parametrize("ambient_dn", [0, 7, 300])
def test_ambient_light_is_the_median_of_the_dark_frame(tmp_path: Path, ambient_dn: int) -> None:
    dark = np.full((48, 64), ambient_dn, np.uint16)
    dark[:10] = 4000  # a window
    contents = logged(tmp_path, lambda stream: frame.log_ambient(stream, frame.median_dn(dark)))
    assert contents.values("/ambient", SCALARS) == [(1, [float(ambient_dn)])]


def test_a_capture_without_spots_removes_the_marks_of_the_last_one(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        frame.log_spots(stream, SPOTS, COLORS, 480)
        stream.at(Moment(2, 1, HERE.time_ns + 1))
        frame.log_spots(stream, (), COLORS, 480)

    contents = logged(tmp_path, log)
    for entity, component in (("/frame/spots", STRIPS), ("/frame/spots", "Points2D:positions")):
        assert contents.values(entity, component)[-1] == (2, [])


def drawn_spot(random: np.random.Generator, laser: str | None, *flags: Failure) -> Spot:
    u_px, v_px, u_sd_px, v_sd_px, flux_dn, width_px, peak_dn = map(float, random.uniform(0.01, 500.0, 7))
    return Spot(u_px, v_px, u_sd_px, v_sd_px, flux_dn, width_px, peak_dn, frozenset(flags), laser)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_record_of_the_spots_is_exact_to_the_last_bit(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    spots = [
        drawn_spot(random, "L1", Failure.SATURATED, Failure.AT_EDGE),
        drawn_spot(random, None),
        drawn_spot(random, "L4"),
    ]
    contents = logged(tmp_path, lambda stream: frame.log_spots(stream, spots, COLORS, 480))
    for name in ("u_px", "v_px", "u_sd_px", "v_sd_px", "flux_dn", "width_px", "peak_dn"):
        assert contents.values("/spots/record", name) == [(1, [getattr(spot, name) for spot in spots])]
    assert contents.values("/spots/record", "laser_id") == [(1, ["L1", "", "L4"])]
    assert contents.values("/spots/record", "flags") == [(1, ["at_edge saturated", "", ""])]


def test_each_laser_has_its_curves_and_others_have_common_ones(tmp_path: Path) -> None:
    spots = [a_spot("L1", 1.25), a_spot(None, 2.5), a_spot(None, 3.5)]
    contents = logged(tmp_path, lambda stream: frame.log_spots(stream, spots, COLORS, 480))
    assert contents.values("/spots/u_px/L1", SCALARS) == [(1, [1.25])]
    assert contents.values("/spots/v_px/L1", SCALARS) == [(1, [240.0])]
    assert contents.values("/spots/peak_dn/L1", SCALARS) == [(1, [80.0])]
    assert contents.values("/spots/unassigned/u_px", SCALARS) == [(1, [2.5, 3.5])]


def test_a_reading_assigns_spots_at_its_positions() -> None:
    spots = [a_spot(None, 100.0), a_spot(None, 100.02), a_spot("L3", 300.0)]
    lasers = (a_range("L2", 500.0, u_px=100.02), a_range("L4", 500.0))
    assert [spot.laser_id for spot in frame.assigned(spots, lasers)] == [None, "L2", "L3"]
    assert [spot.u_px for spot in frame.assigned(spots, lasers)] == [100.0, 100.02, 300.0]


def test_spots_that_a_reading_assigns_are_drawn_again_and_join_their_lasers_curves(tmp_path: Path) -> None:
    found = [a_spot(None, 100.0), a_spot(None, 200.0), a_spot("L3", 300.0)]

    def log(stream: Stream) -> None:
        frame.log_spots(stream, found, COLORS, 480)
        assigned = frame.assigned(found, (a_range("L2", 500.0, u_px=200.0),))
        frame.log_assigned(stream, found, assigned, COLORS, 480)

    contents = logged(tmp_path, log)
    assert contents.values("/frame/spots", "Points2D:labels")[-1] == (1, ["?", "L2", "L3"])
    assert contents.values("/spots/u_px/L2", SCALARS) == [(1, [200.0])]
    assert contents.values("/spots/u_px/L3", SCALARS) == [(1, [300.0])]
    assert contents.values("/spots/record", "u_px") == [(1, [100.0, 200.0, 300.0])]


def test_expected_spots_lie_within_their_marks(tmp_path: Path) -> None:
    expected = {"L1": np.array([100.0, 50.0]), "L3": np.array([7.25, 9.0])}
    contents = logged(tmp_path, lambda stream: frame.log_predicted(stream, expected, COLORS))
    ((_, strips),) = contents.values("/frame/predicted", STRIPS)
    for strip, spot in zip(strips, expected.values(), strict=True):
        np.testing.assert_allclose(np.mean(strip[:-1], axis=0), spot + 0.5, atol=1e-5)
        distances = np.hypot(*(np.array(strip) - spot - 0.5).T)
        np.testing.assert_allclose(distances, PREDICTED_PX, rtol=1e-5)


def test_scanlines_go_from_end_to_end_in_reruns_pixels(tmp_path: Path) -> None:
    lines = {"L1": np.array([[0.0, 10.0], [639.0, 12.0]])}
    contents = logged(tmp_path, lambda stream: frame.log_scanlines(stream, lines, COLORS))
    assert contents.values("/frame/scanlines", STRIPS) == [(1, [[[0.5, 10.5], [639.5, 12.5]]])]


def test_a_label_has_the_laser_and_the_flags() -> None:
    assert label(a_spot("L1", 1.0)) == "L1"
    assert label(a_spot(None, 1.0, 1.0, Failure.SATURATED, Failure.MERGED)) == "? (merged, saturated)"


def test_every_quantity_of_every_laser_has_a_name_and_a_colour(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: frame.log_series_styles(stream, COLORS))
    for quantity in ("u_px", "v_px", "peak_dn"):
        for laser, color in COLORS.items():
            entity = f"/spots/{quantity}/{laser}"
            assert contents.static(entity, "SeriesPoints:names") == [[laser]]
            assert contents.static(entity, "SeriesPoints:colors") == [[packed(color)]]
