"""Spots that the fit puts outside the picture."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.data.observations import Observation, Rejected
from workbench.calibration.estimation.fit import fit


@pytest.mark.parametrize(("standoff_mm", "cause"), [(40.0, "outside the picture, at u = "), (700.0, "dark")])
def test_a_spot_that_cannot_be_in_the_picture_is_not_blamed_on_the_light(
    standoff_mm: float, cause: str
) -> None:
    rig = thesis_rig()
    observations = World(rig, 1).observations(repeats=1)
    missing = Observation("row 9", "L4", "near", standoff_mm, 0, np.nan, np.nan)
    result = fit(rig, observations, [Rejected("row 9", "too dark", missing)])
    assert cause in result.rejected[0].reason
