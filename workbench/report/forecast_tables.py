"""Tables of what a calibration will be worth, at most 80 columns wide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.table import Table

from workbench.calibration.design.forecast import ParameterForecast, RangeForecast


def parameter_forecast_table(parameters: Iterable[ParameterForecast]) -> Table:
    """What is known of each parameter before and after."""
    table = Table(title="Parameters, predicted (sd: 1 sigma)", title_justify="left")
    table.add_column("parameter")
    for column in ("prior sd", "predicted sd", "from data"):
        table.add_column(column, justify="right")
    table.add_column("determined by")
    for p in parameters:
        unit = "" if p.unit == "1" else f" {p.unit}"
        share = f"{100 * p.data_share:.0f} %"
        table.add_row(p.name, f"{p.prior_sd:g}{unit}", f"{p.sd:.2g}{unit}", share, p.determined_by)
    table.caption = "joint: the data tie it to others, whose priors do the rest"
    table.caption_justify = "left"
    return table


def range_forecast_table(laser_ids: Sequence[str], ranges: Iterable[RangeForecast]) -> Table:
    """Relative sd of a single range, over range and laser."""
    table = Table(title="Ranges, predicted (%, 1 sigma)", title_justify="left")
    table.add_column("range (mm)", justify="right")
    for laser_id in laser_ids:
        table.add_column(laser_id, justify="right")
    cells = {(r.range_mm, r.laser_id): _cell(r) for r in ranges}
    for range_mm in dict.fromkeys(at for at, _ in cells):
        table.add_row(f"{range_mm:g}", *(cells[range_mm, laser_id] for laser_id in laser_ids))
    table.caption = "in brackets by the calibration alone; -: the spot is out of the picture"
    table.caption_justify = "left"
    return table


def _cell(r: RangeForecast) -> str:
    if r.relative_sd is None or r.relative_sd_of_calibration is None:
        return "-"
    return f"{100 * r.relative_sd:.2f} ({100 * r.relative_sd_of_calibration:.2f})"
