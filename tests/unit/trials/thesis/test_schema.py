"""Scenes of the thesis's simulation as a file has them."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from tests.support.thesis_scenes import scene


@pytest.mark.parametrize(
    ("changes", "shape"),
    [
        ({}, "flat"),
        ({"incline_deg": 0.0}, "flat"),
        ({"incline_deg": -30.0}, "incline"),
        ({"coefficients": (0.0, 0.02)}, "round 2"),
        ({"coefficients": (1.0, 0.0, 0.0, 0.1)}, "round 4"),
    ],
)
def test_a_surfaces_shape_follows_from_its_formula(changes: dict[str, object], shape: str) -> None:
    assert scene(**changes).shape == shape


@pytest.mark.parametrize(
    "changes",
    [
        {"incline_deg": 30.0, "coefficients": (1.0,)},
        {"incline_deg": 90.0},
        {"set_mm": (500.0, 100.0)},
        {"set_mm": (0.0, 100.0)},
        {"set_mm": (100.0, 200.0, 300.0)},
        {"lines": ("vertical", "vertical")},
        {"lines": ()},
        {"lost": (0,)},
        {"claims": []},
        {"claims": [{"quantity": "range", "stated": -0.1}]},
        {"points": 1},
        {"name": "A scene"},
    ],
)
def test_a_scene_that_makes_no_sense_is_refused(changes: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        scene(**changes)
