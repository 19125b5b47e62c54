"""Tables of derived quantities and of differences."""

from __future__ import annotations

from workbench.calibration.verdict.assessment import Derived
from workbench.calibration.verdict.comparison import Difference
from workbench.calibration.verdict.tables import derived_table, difference_table


def test_derived_quantities_have_the_digits_of_their_sd() -> None:
    derived = Derived(laser_id="1", f_b_px_mm=32478.6, f_b_sd=185.3, infinity_px=203.6071, infinity_sd=0.462)
    table = derived_table([derived])
    assert [table.text(0, i) for i in range(5)] == ["1", "32479", "190", "203.61", "0.46"]
    assert [column.unit for column in table.columns] == ["", "px mm", "px mm", "px", "px"]


def test_differences_have_a_row_for_each_range_and_two_columns_for_each_laser() -> None:
    differences = [
        Difference(laser_id="L1", range_mm=500.0, difference_mm=0.5, sd_mm=0.25),
        Difference(laser_id="L1", range_mm=100.0, difference_mm=-0.125, sd_mm=0.5),
        Difference(laser_id="L2", range_mm=500.0, difference_mm=1.0, sd_mm=0.75),
    ]
    table = difference_table(differences)
    assert table.records() == [
        {
            "range_mm": 100.0,
            "difference_mm.L1": -0.125,
            "sd_mm.L1": 0.5,
            "difference_mm.L2": None,
            "sd_mm.L2": None,
        },
        {
            "range_mm": 500.0,
            "difference_mm.L1": 0.5,
            "sd_mm.L1": 0.25,
            "difference_mm.L2": 1.0,
            "sd_mm.L2": 0.75,
        },
    ]
