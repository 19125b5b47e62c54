"""Names of entities and colours of lasers."""

from __future__ import annotations

import rerun as rr

from workbench.viewer.entities import RED, WHITE, from_hex, laser_colors, packed, to_hex, trial_picture, under


def test_lasers_have_colors_of_their_own_and_names_may_be_odd() -> None:
    colors = laser_colors([str(i) for i in range(7)])
    assert len(set(colors.values())) == 7
    assert under("spots/u_px", "left / 650 nm") == "spots/u_px/left\\ \\/\\ 650\\ nm"


def test_colours_of_charts_and_of_the_recording_are_the_same() -> None:
    assert from_hex("#00ff7f") == (0, 255, 127)
    assert to_hex((0, 255, 127)) == "#00ff7f"


def test_trials_and_charts_of_any_name_have_entities_of_their_own() -> None:
    assert trial_picture("a/b", "c") == "trials/a\\/b/pictures/c"
    assert trial_picture("accuracy-flat.1", "errors") != trial_picture("accuracy-flat.2", "errors")


def test_packed_colors_are_those_that_rerun_makes() -> None:
    for colors in ([], [RED], [RED, WHITE, (1, 2, 3)], [(1, 2, 3)] * 4):
        rerun = rr.components.ColorBatch(colors)
        assert rr.components.ColorBatch(packed(colors)) == rerun
