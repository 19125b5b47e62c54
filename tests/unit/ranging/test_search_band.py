"""The band that is searched for the spots of a line of lasers."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.ranging.lines import Axis
from workbench.ranging.search_band import band
from workbench.spots import Scanline


@pytest.mark.parametrize("axis", ["u", "v"])
def test_one_band_holds_the_scanlines_of_a_line(axis: Axis) -> None:
    rng = np.random.default_rng(3)
    lines = []
    for along in (-200.0, -90.0, 100.0, 210.0):
        aside = rng.uniform(-4.0, 4.0, 2)
        far, near = (350.0, 240.0 + aside[0]), (350.0 + along, 240.0 + aside[1])
        if axis == "v":
            far, near = far[::-1], near[::-1]
        lines.append(Scanline(*far, near[0] - far[0], near[1] - far[1], 8.0))
    found = band(lines, axis)
    assert found.half_width_px < 8.0 + 8.0
    for line in lines:
        for share in (0.0, 0.5, 1.0):
            u, v = line.u0_px + share * line.du, line.v0_px + share * line.dv
            across = (u - found.u0_px) * found.dv - (v - found.v0_px) * found.du
            assert abs(across) / np.hypot(found.du, found.dv) <= found.half_width_px - 8.0 + 1e-9
    assert abs(found.du if axis == "u" else found.dv) == 1.0
