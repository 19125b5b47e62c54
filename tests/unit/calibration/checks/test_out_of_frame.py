"""Spots that the fit puts outside the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.out_of_frame import name_out_of_frame
from workbench.calibration.data.observations import Observation, RejectedObservation
from workbench.calibration.estimation.fit import CalibrationFit, fit


@pytest.mark.parametrize(("standoff_mm", "kept"), [(40.0, False), (700.0, True)])
def test_the_fit_corrects_the_reason_of_a_spot_outside_the_image(standoff_mm: float, kept: bool) -> None:
    rig = thesis_rig()
    observations = World(rig, 1).observations(repeats=1)
    result = fit(rig, observations, [missing("L4", standoff_mm)])
    assert (result.rejected[0].reason == "too dark") == kept


@pytest.fixture(scope="module")
def fitted() -> CalibrationFit:
    return fit(thesis_rig(), World(thesis_rig(), 1).observations(repeats=1))


def missing(laser_id: str, standoff_mm: float) -> RejectedObservation:
    unseen = Observation("row 9", laser_id, "p", standoff_mm, 0, np.nan, np.nan)
    return RejectedObservation("row 9", "too dark", unseen)


@pytest.mark.parametrize(("laser_id", "side"), [("L1", -0.5), ("L4", 639.5)])
def test_the_limit_is_the_edge_of_the_outermost_pixel(
    fitted: CalibrationFit, laser_id: str, side: float
) -> None:
    """The standoff at which the fitted spot crosses the edge, found by bisection of its curve."""
    index = fitted.rig.laser_ids.index(laser_id)
    value = dict(zip((p.name for p in fitted.table.parameters), fitted.values.tolist(), strict=True))
    slope = np.array([value["target_slope_x"], value["target_slope_y"]])
    origin, direction = (
        np.array([value[f"{laser_id}.{n}"] for n in names]) for names in (("x_mm", "y_mm"), ("tx", "ty"))
    )

    def u(standoff_mm: float) -> float:
        z0 = standoff_mm * (1 + value["ruler_scale"]) + value["offset_mm"]
        depth = (z0 + slope @ origin) / (1 - slope @ direction)
        return float(fitted.curves.spots(np.array([index]), np.array([1 / depth]))[0, 0])

    near, far = 30.0, 3000.0
    for _ in range(60):
        middle = (near + far) / 2
        beyond = u(middle) < side if side < 0 else u(middle) > side
        near, far = (middle, far) if beyond else (near, middle)
    told = [missing(laser_id, factor * far) for factor in (0.999, 1.001)]
    outside, inside = name_out_of_frame(fitted.rig, fitted.values, told)
    assert outside.reason != "too dark"
    assert inside == told[1]


def test_only_the_reason_changes_and_outliers_keep_theirs(fitted: CalibrationFit) -> None:
    far_out = missing("L4", 40.0)
    outlier = RejectedObservation("row 3", "outlier", replace(far_out.observation, u_px=700.0))
    renamed, other = name_out_of_frame(fitted.rig, fitted.values, [far_out, outlier])
    assert other == outlier
    assert isinstance(renamed, RejectedObservation)
    assert (renamed.source, renamed.observation) == (far_out.source, far_out.observation)
