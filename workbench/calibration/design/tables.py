"""Tables of a forecast: parameters and ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from workbench.model.fit_tables import DETERMINED_BY
from workbench.model.table import Column, Table

if TYPE_CHECKING:  # imported for annotations alone: commands start faster
    from workbench.calibration.design.forecast import ParameterForecast, RangeForecast


def parameter_forecast_table(parameters: Sequence[ParameterForecast]) -> Table:
    """Standard deviation of each parameter before and after a calibration, 1 sigma."""
    return Table(
        name="parameter_forecast",
        title="Parameters, predicted (sd: 1 sigma)",
        columns=(
            Column(key="name", name="parameter"),
            Column(key="prior_sd", name="prior sd", format=".3g"),
            Column(key="sd", name="sd", format="sd"),
            Column(key="unit", name="unit"),
            Column(key="data_share", name="information share", unit="%", scale=100, format=".0f"),
            Column(key="determined_by", name="determined by"),
        ),
        rows=tuple((p.name, p.prior_sd, p.sd, p.unit, p.data_share, p.determined_by) for p in parameters),
        caption=DETERMINED_BY,
    )


def range_forecast_table(laser_ids: Sequence[str], ranges: Sequence[RangeForecast]) -> Table:
    """Relative standard deviation of a single range: a row for each range, two columns for each laser."""
    cells = {(r.range_mm, r.laser_id): (r.relative_sd, r.relative_sd_of_calibration) for r in ranges}
    return Table(
        name="range_forecast",
        title="Ranges, predicted (relative sd: 1 sigma)",
        columns=(
            Column(key="range_mm", name="range", unit="mm", format="g"),
            *(column for i in laser_ids for column in _laser_columns(i)),
        ),
        rows=tuple(
            (at, *(cell for i in laser_ids for cell in cells[at, i]))
            for at in dict.fromkeys(at for at, _ in cells)
        ),
        caption="alone: by the calibration, without the noise of the spot; -: the spot is outside the image",
    )


def _laser_columns(laser_id: str) -> tuple[Column, Column]:
    percent = {"unit": "%", "scale": 100, "format": ".2f"}
    return (
        Column(key=f"relative_sd.{laser_id}", name=laser_id, **percent),
        Column(key=f"relative_sd_of_calibration.{laser_id}", name="alone", **percent),
    )
