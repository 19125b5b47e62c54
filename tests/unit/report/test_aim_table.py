"""Table of lasers while they are aimed, and its rows in words."""

from __future__ import annotations

import numpy as np

from tests.support.viewer_stream import a_spot
from workbench.model.spot import Failure
from workbench.procedure.aiming import AimReading, Expected
from workbench.report.aim_table import aim_lines, aim_table

DARK = np.zeros((4, 6), np.uint8)
SEEN = AimReading(
    "L1",
    DARK,
    DARK,
    a_spot("L1", 310.25, 240.5, Failure.SATURATED),
    (),
    8.0,
    Expected(300.0, 241.0, 30.0, 9.0),
    1.25,
)
MISSING = AimReading("L2", DARK, DARK, None, ("too dim",), 9.0, Expected(400.0, 240.0), None)


def test_each_laser_has_its_row() -> None:
    table = aim_table([SEEN, MISSING], {"L1": (0.5, -0.25)}, "title")
    rows = [dict(zip([column.key for column in table.columns], row, strict=True)) for row in table.rows]
    assert rows[0] == {
        "laser": "L1",
        "u_px": 310.25,
        "v_px": 240.5,
        "du_px": 10.25,
        "dv_px": -0.5,
        "u_sd_px": 30.0,
        "v_sd_px": 9.0,
        "width_px": 1.5,
        "least_width_px": 1.25,
        "peak_dn": 80.0,
        "ambient_dn": 8.0,
        "x_mrad": 0.5,
        "y_mrad": -0.25,
        "remark": "saturated",
    }
    assert {key: value for key, value in rows[1].items() if value is not None} == {
        "laser": "L2",
        "ambient_dn": 9.0,
        "remark": "no spot, too dim",
    }


def test_a_line_has_the_values_that_there_are() -> None:
    seen, missing = aim_lines(aim_table([SEEN, MISSING], {}, "title"))
    assert seen.startswith("L1: u 310.25 px, v 240.50 px, u off by +10.2 px")
    assert seen.endswith("ambient 8 DN, saturated")
    assert "mrad" not in seen
    assert missing == "L2: ambient 9 DN, no spot, too dim"
