"""Causes of errors, with their sizes."""

from __future__ import annotations

from math import radians

import pytest

from tests.support.four_lasers import reading
from tests.support.rigs import thesis_rig
from workbench.model.event import TrueValues
from workbench.trials.thesis_hardware.causes import COMMON_TILT, PARABOLA, TILT

TRUE = TrueValues(range_mm=400.0, range_sd_mm=0.1, radius_mm=89.0, radius_sd_mm=0.1)


def test_tilts_have_the_size_of_the_bench() -> None:
    rig = thesis_rig()
    bench = rig.bench
    sd = radians((bench.tilt_sd_deg**2 + bench.target_tilt_sd_deg**2) ** 0.5)
    assert TILT.size([], rig) == pytest.approx(2 * sd * max(abs(one.x_mm.value) for one in rig.lasers))
    assert COMMON_TILT.size([], rig) == pytest.approx(2 * bench.target_tilt_sd_deg)


def test_a_parabola_has_its_mean_difference_from_the_cylinder() -> None:
    readings = [reading(TRUE, range_mm=402.0 + n, cylinder_mm=400.0) for n in (0, 2)]
    assert PARABOLA.size(readings, thesis_rig()) == pytest.approx(3.0)
    assert PARABOLA.size([reading(TRUE, range_mm=402.0)], thesis_rig()) is None
