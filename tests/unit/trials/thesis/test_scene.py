"""Lines of lasers and surfaces of the thesis's scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.thesis_scenes import scene
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig, load_rig
from workbench.trials.thesis import scene as scenes

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(ROOT / "rigs/thesis-simulated.yaml")


@pytest.mark.parametrize(
    ("changes", "closest_mm"),
    [
        ({}, 300.0),
        ({"incline_deg": 30.0}, 300.0),
        ({"incline_deg": -30.0}, 300 - 120 * np.tan(np.pi / 6)),
        ({"coefficients": (0.0, 0.02), "shift_mm": 60.0}, 300.0),
        ({"coefficients": (0.0, 0.0, 0.0003), "shift_mm": 60.0}, 300 - 0.0003 * 60**3),
        ({"coefficients": (-16.4, 0.403, -0.003186, 0.0000073)}, 300 - 209.41),
    ],
)
def test_the_closest_point_is_sought_before_the_front(
    rig: Rig, changes: dict[str, object], closest_mm: float
) -> None:
    lines = [scenes.line_of(rig, "horizontal")]
    assert scenes.truth(scene(**changes), lines, 300.0).closest_mm == pytest.approx(closest_mm, abs=0.01)


def test_a_rig_has_to_be_ideal(rig: Rig) -> None:
    bent = rig.camera.model_copy(update={"k1": rig.camera.f_px})
    with pytest.raises(BadInputError, match="set to 0: k1"):
        scenes.line_of(rig.model_copy(update={"camera": bent}), "horizontal")
    with pytest.raises(BadInputError, match="at least 2 lasers in a vertical row"):
        scenes.line_of(load_rig(ROOT / "rigs/thesis-emulated.yaml"), "vertical")
