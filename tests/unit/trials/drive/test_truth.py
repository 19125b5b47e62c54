"""Truth of the beams of a calibrated sensor at poses before a cube and a ramp."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest

from tests.support.driven_steps import CUBE, WORLD
from tests.support.rangers import IDS, thesis_ranger
from workbench.model.world import Pose, Vehicle, World
from workbench.trials.drive.surroundings import Surroundings
from workbench.trials.drive.truth import EDGE_MM, TruthSource

RAMP = {
    "kind": "ramp",
    "name": "ramp",
    "at_mm": [1300, 0],
    "length_mm": 600,
    "width_mm": 600,
    "angle_deg": 30,
}


def source(body: dict[str, object], mount_sd_deg: float = 0.5) -> TruthSource:
    world = World.model_validate(WORLD | {"bodies": [body]})
    return TruthSource(Surroundings(world), Vehicle(), thesis_ranger().sensor, mount_sd_deg)


def test_beams_on_a_square_face_have_its_distance() -> None:
    truth = source(CUBE).at(Pose(x_mm=400, y_mm=0))
    assert truth.clearance.distance_mm == pytest.approx(600.0)
    assert truth.front_mm == pytest.approx(600.0)
    assert truth.front_is_one
    for one in truth.lasers.values():
        assert one.range_mm == pytest.approx(600.0)
        assert (one.body, one.at_edge) == (0, False)
        assert one.sd_mm == pytest.approx(0.0, abs=1e-9)


def test_the_outer_beam_passes_or_meets_the_edge() -> None:
    """Beams are at about +-30 and +-60 mm; the cube ends 100 mm aside of its middle."""
    sensor = thesis_ranger().sensor
    x_mm, _ = sensor.positions_mm(IDS, np.full(4, 600.0))
    # So far to the right that the cube's right face is beside the second beam from the right.
    aside = 100.0 - float(x_mm[2]) - EDGE_MM / 2
    truth = source(CUBE).at(Pose(x_mm=400, y_mm=-aside))
    at_edge = {name: one.at_edge for name, one in truth.lasers.items()}
    assert at_edge["L3"]
    assert not truth.front_is_one
    assert truth.nearest_beam_mm == pytest.approx(600.0)


def test_the_mount_makes_ranges_on_a_slope_uncertain() -> None:
    """A turn by e about the horizontal changes the range on a ramp of 30 deg by e r / tan(30 deg)."""
    truth = source(RAMP, mount_sd_deg=0.5).at(Pose(x_mm=400, y_mm=0))
    expected = 600.0 + 60.0 / tan(radians(30))
    for one in truth.lasers.values():
        assert one.range_mm == pytest.approx(expected, abs=15.0)  # beams point up to 0.3 deg up or down
        assert one.sd_mm == pytest.approx(radians(0.5) * one.range_mm / tan(radians(30)), rel=0.03)
    assert truth.front_sd_mm == pytest.approx(radians(0.5) * truth.front_mm / tan(radians(30)), rel=0.03)
