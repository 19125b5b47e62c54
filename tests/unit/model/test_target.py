"""Targets: which shape a mapping is, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from workbench.model.target import (
    BoardTarget,
    CylinderTarget,
    FlatTarget,
    NoTarget,
    Placement,
    PolynomialTarget,
    TargetShape,
)

SHAPE: TypeAdapter[Any] = TypeAdapter(TargetShape)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"shape": "flat", "yaw_deg": 10}, FlatTarget(yaw_deg=10.0)),
        ({"shape": "board", "roll_deg": 90}, BoardTarget(roll_deg=90.0)),
        ({"shape": "cylinder", "diameter_mm": 178}, CylinderTarget(diameter_mm=178.0)),
        ({"shape": "polynomial", "coefficients": [0.0, 0.02]}, PolynomialTarget(coefficients=(0.0, 0.02))),
        ({"shape": "none"}, NoTarget()),
    ],
)
def test_the_shape_tells_the_kind_and_json_keeps_it(data: dict[str, Any], expected: object) -> None:
    found = SHAPE.validate_python(data)
    assert found == expected
    assert SHAPE.validate_json(SHAPE.dump_json(found)) == expected


@pytest.mark.parametrize(
    "wrong",
    [
        {"shape": "egg"},
        {"yaw_deg": 3.0},
        {"shape": "cylinder"},
        {"shape": "cylinder", "diameter_mm": 0.0},
        {"shape": "flat", "width_mm": 0.0},
        {"shape": "flat", "diameter_mm": 10.0},
        {"shape": "flat", "finish": "glossy"},
        {"shape": "polynomial", "coefficients": []},
        {"shape": "polynomial", "coefficients": [0.0] * 5},
        {"shape": "board", "roll_deg": float("nan")},
    ],
)
def test_targets_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        SHAPE.validate_python(wrong)


def test_a_placement_is_a_flat_across_the_axis_unless_it_says_more() -> None:
    placement = Placement(key="P", standoff_mm=500.0)
    assert placement.target == FlatTarget()
    assert placement.standoff_sd_mm is None
    again = Placement.model_validate_json(placement.model_dump_json())
    assert again == placement
    for wrong in ({"standoff_mm": 0.0}, {"standoff_mm": 500.0, "standoff_sd_mm": -0.1}):
        with pytest.raises(ValidationError):
            Placement.model_validate({"key": "P"} | wrong)
