"""Lasers in the viewer while they are aimed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun.blueprint as rrb

from tests.support.viewer_stream import a_spot, bright_spot, drawn_frame, logged
from tests.viewer.session import LASERS, a_rig
from workbench.procedure.aiming import AimReading, Expected
from workbench.report.aim_table import aim_table
from workbench.viewer.aim_view import AimView, aim_layout
from workbench.viewer.stream import Stream

DARK = drawn_frame([], 8.0)


def a_round(missing: str) -> tuple[AimReading, ...]:
    """Readings of all lasers, of which one has no spot."""
    readings = []
    for n, laser in enumerate(LASERS):
        spot = bright_spot(None, 200.0 + 60.0 * n, 240.0, 100.0)
        seen = laser != missing
        on = drawn_frame([spot], 8.0) if seen else DARK
        expected = Expected(spot.u_px + 5.0, 240.0)
        readings.append(AimReading(laser, on, DARK, spot if seen else None, (), 8.0, expected, 1.5))
    return tuple(readings)


def test_a_round_shows_every_spot_in_one_frame_and_magnified(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = AimView(stream, a_rig())
        for missing in ("L4", "L2"):
            readings = a_round(missing)
            view.take((readings, aim_table(readings, {}, "title")))

    contents = logged(tmp_path, log)
    labels = contents.values("/frame/spots", "Points2D:labels")
    assert [texts for _, texts in labels] == [["L1", "L2", "L3"], ["L1", "L3", "L4"]]
    ((_, first), (_, second)) = contents.values("/crops/labels", "Points2D:labels")
    assert [text for text in first if "no spot" in text] == ["L4 no spot"]
    assert [text for text in second if "no spot" in text] == ["L2 no spot"]
    assert not any("earlier" in text for text in (*first, *second))
    assert contents.values("/aim/width_px/L2", "Scalars:scalars") == [(1, [1.5])]
    assert len(contents.values("/aim/table", "TextDocument:text")) == 2
    assert len(contents.values("/frame/predicted", "LineStrips2D:strips")[0][1]) == len(LASERS)


def test_without_a_standoff_a_missing_spot_has_no_crop(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        reading = AimReading("L1", DARK, DARK, None, (), 8.0, None, None)
        AimView(stream, a_rig()).take(((reading,), aim_table([reading], {}, "title")))

    ((_, labels),) = logged(tmp_path, log).values("/crops/labels", "Points2D:labels")
    assert labels == list(LASERS)


def test_the_layout_is_one_screen() -> None:
    assert isinstance(aim_layout(a_rig()).root_container, rrb.Vertical)
    assert np.isfinite(a_spot("L1", 1.0).u_px)
