"""Names of entities and colours of lasers."""

from __future__ import annotations

from workbench.viewer.entities import laser_colors, under


def test_lasers_have_colors_of_their_own_and_names_may_be_odd() -> None:
    colors = laser_colors([str(i) for i in range(7)])
    assert len(set(colors.values())) == 7
    assert under("spots/u_px", "left / 650 nm") == "spots/u_px/left\\ \\/\\ 650\\ nm"
