"""Frames and spots in the recording: pixels, names, colours and curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.viewer_stream import COLORS, a_range, a_spot, logged, packed
from workbench.model.spot import Failure
from workbench.viewer.camera import (
    QUANTITIES,
    log_assigned,
    log_frame,
    log_series_styles,
    log_spots,
)
from workbench.viewer.entities import WHITE

DOTS, RINGS = "/bench/camera/spots", "/bench/camera/rings"


def test_a_frame_is_logged_as_it_is(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_frame(stream, b"the bytes of a PNG"))
    assert contents.values("/bench/camera/image", "EncodedImage:blob") == [(1, b"the bytes of a PNG")]
    ((_, kind),) = contents.values("/bench/camera/image", "EncodedImage:media_type")
    assert kind == ["image/png"]


def test_dots_lie_at_rerun_s_pixels_in_the_laser_s_colour(tmp_path: Path) -> None:
    spots = (a_spot("L2", 100.25, 50.75), a_spot(None, 300.0, 20.0, Failure.SATURATED, Failure.MERGED))
    contents = logged(tmp_path, lambda stream: log_spots(stream, spots, COLORS))
    ((_, positions),) = contents.values(DOTS, "Points2D:positions")
    np.testing.assert_allclose(positions, [[100.75, 51.25], [300.5, 20.5]])
    ((_, colors),) = contents.values(DOTS, "Points2D:colors")
    assert colors == [packed(COLORS["L2"]), packed(WHITE)]
    ((_, labels),) = contents.values(DOTS, "Points2D:labels")
    assert labels == ["L2", "? (merged, saturated)"]


def test_a_ring_goes_round_each_spot_and_leaves_its_light_free(tmp_path: Path) -> None:
    spots = (a_spot("L1", 100.0, 50.0), a_spot("L3", 300.0, 20.0))
    contents = logged(tmp_path, lambda stream: log_spots(stream, spots, COLORS))
    ((_, rings),) = contents.values(RINGS, "LineStrips2D:strips")
    for ring, spot in zip(rings, spots, strict=True):
        away = np.hypot(*(np.array(ring) - [spot.u_px + 0.5, spot.v_px + 0.5]).T)
        np.testing.assert_allclose(away, away[0], rtol=1e-4)
        assert away[0] > 4 * spot.width_px
        np.testing.assert_allclose(ring[0], ring[-1], atol=1e-4)


def test_every_quantity_has_a_curve_for_each_laser(tmp_path: Path) -> None:
    spots = (a_spot("L1", 10.0), a_spot(None, 30.0), a_spot(None, 20.0))
    contents = logged(tmp_path, lambda stream: log_spots(stream, spots, COLORS))
    for quantity in QUANTITIES:
        value = getattr(spots[0], quantity)
        assert contents.values(f"/spots/{quantity}/L1", "Scalars:scalars") == [(1, [value])]
        of_none = [getattr(spot, quantity) for spot in spots[1:]]
        assert contents.values(f"/spots/unassigned/{quantity}", "Scalars:scalars") == [(1, of_none)]


def test_no_spots_clear_the_picture(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_spots(stream, (), COLORS))
    assert contents.values(DOTS, "Points2D:positions") == [(1, [])]
    assert contents.values(RINGS, "LineStrips2D:strips") == [(1, [])]


@pytest.mark.parametrize(("apart_px", "owner"), [(0.009, "L2"), (0.011, "?")])
def test_a_spot_belongs_to_the_laser_that_was_ranged_by_it(
    tmp_path: Path, apart_px: float, owner: str
) -> None:
    ranged = (a_range("L1", 500.0), a_range("L2", 500.0, u_px=300.0 + apart_px))
    contents = logged(tmp_path, lambda stream: log_assigned(stream, (a_spot(None, 300.0),), ranged, COLORS))
    ((_, labels),) = contents.values(DOTS, "Points2D:labels")
    assert labels == [owner]
    assert not any(entity.startswith("/spots/") for entity in contents.entities)


def test_a_spot_s_own_laser_stays_where_no_range_is_its(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_assigned(stream, (a_spot("L3", 300.0),), (), COLORS))
    assert contents.values(DOTS, "Points2D:labels") == [(1, ["L3"])]


def test_curves_have_the_lasers_names_and_colours(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_series_styles(stream, COLORS))
    for laser, color in COLORS.items():
        (row,) = contents.everything()[f"/spots/peak_dn/{laser}"]
        assert f"[{packed(color)}]" in row
        assert f"['{laser}']" in row
