"""Tables of derived quantities of a fit, and of the difference of two calibrations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from workbench.model.table import Column, Table

if TYPE_CHECKING:  # imported for annotations alone: commands start faster
    from workbench.calibration.verdict.assessment import Derived
    from workbench.calibration.verdict.comparison import Difference


def derived_table(derived: Sequence[Derived]) -> Table:
    """Quantities of each laser that the data determine under any priors."""
    return Table(
        name="derived",
        title="Determined by the data (sd: 1 sigma)",
        columns=(
            Column(key="laser", name="laser"),
            Column(key="f_b_px_mm", name="f x baseline", unit="px mm", format="digits of f_b_sd"),
            Column(key="f_b_sd", name="sd", unit="px mm", format="sd"),
            Column(key="infinity_px", name="spot at infinity", unit="px", format="digits of infinity_sd"),
            Column(key="infinity_sd", name="sd", unit="px", format="sd"),
        ),
        rows=tuple((d.laser_id, d.f_b_px_mm, d.f_b_sd, d.infinity_px, d.infinity_sd) for d in derived),
    )


def difference_table(differences: Sequence[Difference]) -> Table:
    """Range by B - range by A: a row for each range, two columns for each laser."""
    ids = list(dict.fromkeys(d.laser_id for d in differences))
    cells = {(d.range_mm, d.laser_id): (d.difference_mm, d.sd_mm) for d in differences}
    ranges = sorted({d.range_mm for d in differences})
    return Table(
        name="differences",
        title="B - A (sd: 1 sigma of both calibrations)",
        columns=(
            Column(key="range_mm", name="range", unit="mm", format=".0f"),
            *(column for i in ids for column in _laser_columns(i)),
        ),
        rows=tuple((at, *(c for i in ids for c in cells.get((at, i), (None, None)))) for at in ranges),
        caption="-: not in the image",
    )


def _laser_columns(laser_id: str) -> tuple[Column, Column]:
    return (
        Column(key=f"difference_mm.{laser_id}", name=laser_id, unit="mm", format="+.2f"),
        Column(key=f"sd_mm.{laser_id}", name="sd", unit="mm", format=".2f"),
    )
