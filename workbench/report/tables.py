"""Tables of two trials for the terminal, at most 80 columns wide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

if TYPE_CHECKING:  # a table of one of them is made without the rest
    from workbench.model.event import TrialRow
    from workbench.model.simulation import ClaimRow


def trial_table(rows: Sequence[TrialRow]) -> Table:
    """An accuracy trial: errors are measured - true."""
    table = Table(title="Accuracy (mm; error = measured - true)", title_justify="left")
    for column in ("true", "mean", "max", "min", "sd", "stated", "placing", "mean %"):
        table.add_column(column, justify="right")
    for row in rows:
        relative = None if row.mean_error_mm is None else 100 * row.mean_error_mm / row.standoff_mm
        table.add_row(
            f"{row.standoff_mm:g}",
            _signed(row.mean_error_mm),
            _signed(row.max_error_mm),
            _signed(row.min_error_mm),
            _plain(row.sd_mm),
            _plain(row.range_sd_mm),
            _plain(row.reference_sd_mm),
            _signed(relative),
        )
    table.caption = "a reading is the mean of the lasers; stated, placing: 1 sigma"
    table.caption_justify = "left"
    return table


def claim_table(rows: Iterable[ClaimRow]) -> Table:
    """What the thesis states of its simulation, what its chain reaches and what ours does."""
    table = Table(
        title="The thesis's simulation (without noise but for the last column)",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    table.add_column("scene", no_wrap=True)
    table.add_column("what", no_wrap=True)
    for column in ("stated", "thesis", "ours", "noise"):
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        stated, thesis, ours, noisy = (
            _reached(row, value) for value in (row.stated, row.thesis, row.ours, row.noisy)
        )
        table.add_row(
            row.scene,
            f"{row.quantity} {row.nearest_mm:g}-{row.farthest_mm:g}",
            stated,
            thesis + ("*" if row.reproduced is False else " "),
            ours + (" " if row.better else "!"),
            noisy,
        )
    table.caption = (
        "range, angle: largest error; shape: farthest distance with the right\n"
        "one, mm; readings: how many. thesis: its own chain, run again;\n"
        "*: not what it states. !: ours is not better"
    )
    table.caption_justify = "left"
    return table


def _reached(row: ClaimRow, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{100 * value:.2f} %" if row.quantity in {"range", "angle"} else f"{value:.0f}"


def _signed(value: float | None) -> str:
    return "-" if value is None else f"{value:+.2f}"


def _plain(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
