"""Charts of a fit: residuals against standoff."""

from __future__ import annotations

from workbench.model.chart import Axis, Chart, Series
from workbench.model.fit_event import FitFinished, ResidualRecord
from workbench.model.rig import ImageAxis


def residual_chart(fit: FitFinished, axis: ImageAxis) -> Chart:
    """Residuals (measured - predicted, px) along one image axis, a series for each laser, 1 sigma bars."""
    lasers = dict.fromkeys(one.laser_id for one in fit.residuals)
    return Chart(
        name=f"residuals_{axis}",
        title=f"Residuals along {axis}, bars 1 sigma",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label=f"residual {axis}", unit="px"),
        series=tuple(
            _series(laser, [one for one in fit.residuals if one.laser_id == laser], axis) for laser in lasers
        ),
        flagged_x=tuple(dict.fromkeys(one.standoff_mm for one in fit.left_out if one.alarm)),
    )


def _series(laser: str, residuals: list[ResidualRecord], axis: ImageAxis) -> Series:
    sd = tuple(one.u_sd_px if axis == "u" else one.v_sd_px for one in residuals)
    return Series(
        name=laser,
        x=tuple(one.standoff_mm for one in residuals),
        y=tuple(one.u_px if axis == "u" else one.v_px for one in residuals),
        sd=sd,
        expected_sd=sd,
    )
