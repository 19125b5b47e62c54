"""Tables of a forecast."""

from __future__ import annotations

from workbench.calibration.design.forecast import ParameterForecast, RangeForecast
from workbench.calibration.design.tables import parameter_forecast_table, range_forecast_table


def test_parameters_have_their_sd_before_and_after() -> None:
    forecast = ParameterForecast(
        "f_px", "px", prior_sd=26.7, sd=1.312, data_share=0.124, determined_by="joint"
    )
    table = parameter_forecast_table([forecast])
    assert [table.text(0, i) for i in range(6)] == ["f_px", "26.7", "1.3", "px", "12", "joint"]


def test_ranges_have_two_percentages_for_each_laser_and_gaps_where_no_spot_is_seen() -> None:
    ranges = [
        RangeForecast("L1", 100.0, None, None),
        RangeForecast("L2", 100.0, 0.0021, 0.0020),
        RangeForecast("L1", 5000.0, 0.0114, 0.0035),
        RangeForecast("L2", 5000.0, 0.0226, 0.0064),
    ]
    table = range_forecast_table(("L1", "L2"), ranges)
    assert [[table.text(row, i) for i in range(5)] for row in range(2)] == [
        ["100", "-", "-", "0.21", "0.20"],
        ["5000", "1.14", "0.35", "2.26", "0.64"],
    ]
    assert {column.unit for column in table.columns[1:]} == {"%"}
