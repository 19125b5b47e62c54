"""The band that is searched for the spots of a line of lasers."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots import Scanline
from workbench.spots.search_band import band


@pytest.mark.parametrize("axis", ["u", "v"])
def test_one_band_holds_the_scanlines_of_a_line(axis: str) -> None:
    rng = np.random.default_rng(3)
    lines = []
    for along in (-200.0, -90.0, 100.0, 210.0):
        aside = rng.uniform(-4.0, 4.0, 2)
        far, near = (350.0, 240.0 + aside[0]), (350.0 + along, 240.0 + aside[1])
        if axis == "v":
            far, near = far[::-1], near[::-1]
        lines.append(Scanline(*far, near[0] - far[0], near[1] - far[1], 8.0))
    found = band(lines)
    assert found.half_width_px < 8.0 + 8.0
    for line in lines:
        for share in (0.0, 0.5, 1.0):
            u, v = line.u0_px + share * line.du, line.v0_px + share * line.dv
            across = (u - found.u0_px) * found.dv - (v - found.v0_px) * found.du
            assert abs(across) / np.hypot(found.du, found.dv) <= found.half_width_px - 8.0 + 1e-9
    assert abs(found.du if axis == "u" else found.dv) == 1.0


def test_the_band_of_one_line_is_that_line() -> None:
    line = Scanline(320.0, 240.0, -180.0, 9.0, 8.0)
    found = band([line, line])
    assert found.half_width_px == pytest.approx(8.0)
    assert (found.u0_px, found.du) == (0.0, 1.0)
    assert found.dv == pytest.approx(-0.05)
    assert found.v0_px == pytest.approx(240.0 + 0.05 * 320.0)


def test_parallel_lines_widen_the_band_by_half_their_distance() -> None:
    lines = [Scanline(240.0 + aside, 320.0, 0.0, 100.0, 5.0) for aside in (-3.0, 3.0)]
    found = band(lines)
    assert (found.u0_px, found.du, found.dv) == pytest.approx((240.0, 0.0, 1.0))
    assert found.half_width_px == pytest.approx(8.0)
