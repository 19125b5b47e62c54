"""Table of the lasers while they are aimed and focused, and the same as one line a laser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from workbench.model.table import Column, Table
from workbench.model.table_layout import text_columns
from workbench.procedure.aiming import AimReading

NO_SPOT = "no spot"


def aim_table(
    readings: Sequence[AimReading], directions_mrad: Mapping[str, tuple[float, float]], title: str
) -> Table:
    """Place, focus, brightness and direction of each laser, one row each.

    Args:
        readings: latest reading of each laser.
        directions_mrad: directions of the beams relative to their mean, x and y.
        title: standoff and exposure.
    """
    return Table(
        name="aim",
        title=title,
        columns=(
            Column(key="laser", name="laser"),
            Column(key="u_px", name="u", unit="px", format=".2f"),
            Column(key="v_px", name="v", unit="px", format=".2f"),
            Column(key="du_px", name="u off by", unit="px", format="+.1f"),
            Column(key="dv_px", name="v off by", unit="px", format="+.1f"),
            Column(key="u_sd_px", name="sd u", unit="px", format="sd"),
            Column(key="v_sd_px", name="sd v", unit="px", format="sd"),
            Column(key="width_px", name="width", unit="px", format=".2f"),
            Column(key="least_width_px", name="least", unit="px", format=".2f"),
            Column(key="peak_dn", name="peak", unit="DN", format=".0f"),
            Column(key="ambient_dn", name="ambient", unit="DN", format=".0f"),
            Column(key="x_mrad", name="x", unit="mrad", format="+.2f"),
            Column(key="y_mrad", name="y", unit="mrad", format="+.2f"),
            Column(key="remark", name="remark"),
        ),
        rows=tuple(_row(one, directions_mrad.get(one.laser_id, (None, None))) for one in readings),
        caption=(
            "off by: spot - expected spot, sd: 1 sigma of that; width: 1 sigma of the profile, least: so far"
            " at this standoff; x, y: direction relative to the mean beam, from the last two standoffs"
        ),
    )


def aim_lines(table: Table) -> list[str]:
    """The rows in words, one line each; cells without a value are left out."""
    columns = text_columns(table)
    lines = []
    for cells in zip(*(column.cells for column in columns), strict=True):
        laser, *values = cells
        parts = [
            value if column.key == "remark" else f"{column.name} {value} {column.unit}".rstrip()
            for column, value in zip(table.columns[1:], values, strict=True)
            if value.strip(" -")
        ]
        lines.append(f"{laser}: {', '.join(parts)}")
    return lines


def _row(
    one: AimReading, direction_mrad: tuple[float | None, float | None]
) -> tuple[float | str | None, ...]:
    spot, expected = one.spot, one.expected
    if spot is None:
        nothing = (None,) * 8
        return one.laser_id, *nothing, None, one.ambient_dn, None, None, ", ".join((NO_SPOT, *one.failures))
    off: tuple[float | None, ...] = (None,) * 4
    if expected is not None:
        off = (
            spot.u_px - expected.u_px,
            spot.v_px - expected.v_px,
            expected.u_sd_px,
            expected.v_sd_px,
        )
    remarks = (*sorted(flag.value for flag in spot.flags), *one.failures)
    return (
        one.laser_id,
        spot.u_px,
        spot.v_px,
        *off,
        spot.width_px,
        one.least_width_px,
        spot.peak_dn,
        one.ambient_dn,
        *direction_mrad,
        ", ".join(remarks),
    )
