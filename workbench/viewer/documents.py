"""What an engineer reads about a fit and a trial, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import floor, log10

from workbench.model.calibration import TERM_VERDICTS, TermSummary
from workbench.model.event import (
    FitFinished,
    LeftOutRecord,
    ParameterRecord,
    ReadingTaken,
)


def fit_summary(fit: FitFinished) -> str:
    """Verdict first, then why, then how good."""
    lines = [
        f"# Calibration {fit.verdict}",
        _bullets("Why", fit.reasons),
        _bullets("Warnings", fit.warnings),
        f"**Residual** {fit.rms_px:.3f} px rms over {fit.observations} observations, "
        f"{len(fit.rejected)} rejected.",
    ]
    return "\n\n".join(line for line in lines if line)


def parameter_table(parameters: Sequence[ParameterRecord]) -> str:
    """Every parameter with its standard deviation, its prior, and who determined it."""
    rows = [
        (
            one.name,
            plus_minus(one.value, one.sd),
            one.unit if one.unit != "1" else "",
            plus_minus(one.prior_value, one.prior_sd),
            f"{100 * one.data_share:.0f} %",
            one.determined_by,
        )
        for one in parameters
    ]
    head = ("parameter", "value", "unit", "prior", "from the data", "determined by")
    return "\n\n".join(["# Parameters (one sigma)", _table(head, rows)])


def checks(fit: FitFinished) -> str:
    """Which standoff is bad, and which terms of the model the data need, as far as the fit looked."""
    parts = [
        _left_out_table(fit.left_out) if fit.left_out else "",
        _term_table(fit.terms) if fit.terms else "",
    ]
    return "\n\n".join(part for part in parts if part) or "# Nothing was checked"


def _left_out_table(left_out: Sequence[LeftOutRecord]) -> str:
    ids = list(dict.fromkeys(laser.laser_id for one in left_out for laser in one.lasers))
    rows = []
    for one in left_out:
        errors = {laser.laser_id: laser.error_mm for laser in one.lasers}
        rows.append(
            (
                f"{one.standoff_mm:g}",
                f"{one.error_mm:+.2f}",
                f"{one.sd_mm:.2f}",
                f"{one.error_mm / one.sd_mm:+.1f}",
                "**farther off than promised**" if one.alarm else "",
                *(_number(errors.get(i), "+.2f") for i in ids),
            )
        )
    head = ("standoff mm", "error mm", "promised sd", "error / sd", "alarm", *(f"{i} mm" for i in ids))
    return "# Each standoff ranged by the fit without it\n\n" + _table(head, rows)


def _term_table(terms: Sequence[TermSummary]) -> str:
    head = ("term", "p without it", "log10 Bayes factor", "shift of ranges without it, sd", "verdict")
    rows = [
        (
            one.name,
            f"{one.p_value:.2g}",
            f"{one.log10_bayes_factor:+.1f}",
            _number(one.range_shift_sd, ".2g"),
            TERM_VERDICTS[one.verdict],
        )
        for one in terms
    ]
    return "# Terms of the model\n\n" + _table(head, rows)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def without_range(readings: Iterable[ReadingTaken]) -> list[str]:
    """The readings that gave no range, as one list; none where all have one."""
    missing = [
        f"{one.standoff_mm:g} mm, reading {one.reading}: {one.status}"
        for one in readings
        if one.range_mm is None
    ]
    return [_bullets("Readings without a range", missing)] if missing else []


def plus_minus(value: float, sd: float) -> str:
    """A value to the second digit of its standard deviation; a constant as it is."""
    if sd <= 0:
        return f"{value:g} (fixed)"
    digits = max(0, 1 - floor(log10(sd)))
    # Adding zero turns a rounded -0.0 into 0.0.
    return f"{round(value, digits) + 0.0:.{digits}f} ± {sd:.{digits}f}"


def _bullets(title: str, lines: Iterable[str]) -> str:
    items = "\n".join(f"- {line}" for line in lines)
    return f"**{title}**\n\n{items}" if items else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, rule, *rows))
