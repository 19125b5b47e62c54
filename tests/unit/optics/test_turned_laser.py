"""Ray of a scanning head at a reading, and its deviations, compared with heads of the virtual bench."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import thesis_rig
from tests.support.scanned_head import SimulatedHead, inclined_rig
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.optics.rays import RAY
from workbench.optics.turned_laser import turned_laser

RIG = load_rig(Path(__file__).parents[3] / "rigs/scanning-head-emulated.yaml")
HEADS = 800


@pytest.mark.parametrize("reading_deg", [-40.0, 0.0, 25.0])
def test_drawn_heads_scatter_about_the_ray_as_stated(reading_deg: float) -> None:
    rig = inclined_rig(RIG)
    laser = turned_laser(rig, reading_deg)
    drawn = [asdict(SimulatedHead.of(rig, seed).ray("p", reading_deg)) for seed in range(HEADS)]
    rays = np.array([[ray[name] for name in RAY] for ray in drawn])
    sd = np.array([getattr(laser, name).sd for name in RAY])
    mean = np.array([getattr(laser, name).value for name in RAY])
    # The error of a standard deviation of n draws is sd / sqrt(2 n), that of a mean sd / sqrt(n).
    np.testing.assert_allclose(rays.std(axis=0), sd, rtol=4 / np.sqrt(2 * HEADS))
    assert (np.abs(rays.mean(axis=0) - mean) < 4.5 * sd / np.sqrt(HEADS)).all()


def test_at_the_reading_0_an_upright_axis_has_the_ray_of_the_rig_file() -> None:
    laser = turned_laser(RIG, 0.0)
    for name in RAY:
        assert getattr(laser, name).value == pytest.approx(getattr(RIG.head_laser, name).value, abs=1e-12)
    assert (laser.id, laser.axis) == (RIG.head_laser.id, RIG.head_laser.axis)


def test_a_rig_without_head_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected a scanning head"):
        turned_laser(thesis_rig(), 0.0)
