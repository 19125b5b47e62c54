"""Tables for people, at most 80 columns wide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import floor, log10
from typing import TYPE_CHECKING

from rich.table import Table

from workbench.model.calibration import TERM_VERDICTS, TermSummary

if TYPE_CHECKING:  # a table of one of them is made without the rest
    from workbench.calibration.data.observations import Rejected
    from workbench.calibration.verdict.assessment import Derived
    from workbench.calibration.verdict.comparison import Difference
    from workbench.model.event import LeftOutRecord, ParameterRecord, RejectedRecord

DETERMINED_BY_WORDS = {"data": "data", "joint": "joint", "prior": "prior"}


def parameter_table(parameters: Iterable[ParameterRecord]) -> Table:
    """Fitted parameters; constants are left out."""
    table = Table(title="Parameters (sd: 1 sigma)", title_justify="left")
    table.add_column("parameter")
    for column in ("value", "sd", "prior sd", "from data"):
        table.add_column(column, justify="right")
    table.add_column("determined by")
    for p in parameters:
        if p.prior_sd > 0:
            unit = "" if p.unit == "1" else f" {p.unit}"
            table.add_row(
                p.name,
                f"{significant(p.value, p.sd)}{unit}",
                _two_digits(p.sd),
                f"{p.prior_sd:g}",
                f"{100 * p.data_share:.0f} %",
                DETERMINED_BY_WORDS[p.determined_by],
            )
    table.caption = "joint: the data tie it to others, whose priors do the rest"
    table.caption_justify = "left"
    return table


def derived_table(derived: Iterable[Derived]) -> Table:
    """What each laser's data determine whatever the priors say."""
    table = Table(title="Determined by the data (sd: 1 sigma)", title_justify="left")
    table.add_column("laser")
    for column in ("f x baseline (px mm)", "sd", "spot at infinity (px)", "sd"):
        table.add_column(column, justify="right")
    for d in derived:
        table.add_row(
            d.laser_id,
            significant(d.f_b_px_mm, d.f_b_sd),
            f"{d.f_b_sd:.3g}",
            significant(d.infinity_px, d.infinity_sd),
            _two_digits(d.infinity_sd),
        )
    return table


def left_out_table(left_out: Sequence[LeftOutRecord]) -> Table:
    """Cross-validation: each standoff as the fit without it ranges it."""
    ids = list(dict.fromkeys(laser.laser_id for one in left_out for laser in one.lasers))
    table = Table(title="Each standoff ranged by the fit without it", title_justify="left")
    for column in ("standoff", "error mm", "sd", "error/sd", *(f"{i} %" for i in ids)):
        table.add_column(column, justify="right")
    for one in left_out:
        relative = {laser.laser_id: 100 * laser.error_mm / one.standoff_mm for laser in one.lasers}
        table.add_row(
            f"{one.standoff_mm:g}",
            _signed(one.error_mm),
            _two_digits(one.sd_mm),
            f"{one.error_mm / one.sd_mm:+.1f}{' !' if one.alarm else ''}",
            *(_signed(relative.get(i)) for i in ids),
        )
    table.caption = "error: range - standoff; sd: promised, 1 sigma; %: each laser alone"
    table.caption_justify = "left"
    return table


def term_table(terms: Iterable[TermSummary]) -> Table:
    """The evidence on terms of the model."""
    table = Table(title="Terms of the model, each against its absence", title_justify="left")
    table.add_column("term")
    for column in ("p", "evidence", "ranges"):
        table.add_column(column, justify="right")
    table.add_column("verdict")
    for t in terms:
        shift = "-" if t.range_shift_sd is None else f"{t.range_shift_sd:.2g} sd"
        table.add_row(
            t.name, f"{t.p_value:.2g}", f"{t.log10_bayes_factor:+.1f}", shift, TERM_VERDICTS[t.verdict]
        )
    table.caption = (
        "p: chance of such data without the term; evidence: log10 of the Bayes factor for it;"
        " ranges: how far they move without it"
    )
    table.caption_justify = "left"
    return table


def difference_table(differences: Iterable[Difference]) -> Table:
    """Range by B - range by A, over standoff and laser."""
    rows = list(differences)
    ids = list(dict.fromkeys(d.laser_id for d in rows))
    table = Table(title="B - A (mm, +- 1 sigma)", title_justify="left")
    table.add_column("range", justify="right")
    for laser_id in ids:
        table.add_column(laser_id, justify="right")
    for range_mm in sorted({d.range_mm for d in rows}):
        cells = {
            d.laser_id: f"{d.difference_mm:+.2f} +- {d.sd_mm:.2f}" for d in rows if d.range_mm == range_mm
        }
        table.add_row(f"{range_mm:.0f}", *(cells.get(i, "-") for i in ids))
    return table


def rejected_lines(rejected: Iterable[Rejected | RejectedRecord]) -> list[str]:
    """What a fit left out, one line for each reason."""
    sources: dict[str, list[str]] = {}
    for r in rejected:
        sources.setdefault(r.reason, []).append(r.source)
    return [f"{_and_more(names)}: {reason}" for reason, names in sources.items()]


def significant(value: float, sd: float) -> str:
    """`value` with the digits that its standard deviation leaves meaningful: two of the sd."""
    if sd <= 0:
        return f"{value:g}"
    digits = max(0, 1 - floor(log10(sd)))
    return f"{value:.{digits}f}"


def with_sd(value: float, sd: float) -> str:
    """A value with its standard deviation."""
    return f"{significant(value, sd)} +- {_two_digits(sd)}"


def _and_more(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def _two_digits(sd: float) -> str:
    """Two significant digits, without an exponent for what a person would write out."""
    return f"{float(f'{sd:.2g}'):g}"


def _signed(value: float | None) -> str:
    return "-" if value is None else f"{value:+.2f}"


def _plain(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
