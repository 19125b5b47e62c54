"""Documents about a fit and a trial, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from workbench.model.event import (
    FitFinished,
    ReadingTaken,
    TrialFinished,
    TrialRow,
)
from workbench.model.simulation import ClaimRow, SimulationFinished


def fit_summary(fit: FitFinished) -> str:
    """Verdict first, then why, then how good."""
    lines = [
        f"**Calibration {fit.verdict}**",
        _bullets("Why", fit.reasons),
        _bullets("Warnings", fit.warnings),
        f"**Residual** {fit.rms_px:.3f} px rms over {fit.observations} observations, "
        f"{len(fit.rejected)} rejected.",
    ]
    return "\n\n".join(line for line in lines if line)


def trial_table(trial: TrialFinished, readings: Sequence[ReadingTaken]) -> str:
    """The table of an accuracy trial, and the readings that gave no range."""
    head = ("true mm", "n", "missing", "mean error", "max", "min", "sd", "stated sd", "sd of the true range")
    rows = [_trial_row(row) for row in trial.rows]
    parts = [f"# Trial {trial.trial}", "Errors are measured - true, in mm.", _table(head, rows)]
    return "\n\n".join([*parts, *_without_range(readings)])


def claim_table(finished: SimulationFinished) -> str:
    """What the thesis states of its simulation, what its chain reaches, and ours without and with noise."""
    head = ("scene", "what", "stated", "thesis", "ours", "noise")
    rows = [
        (
            row.scene,
            f"{row.quantity}, {row.nearest_mm:g} to {row.farthest_mm:g} mm",
            *(_claimed(row, value) for value in (row.stated, row.thesis, row.ours, row.noisy)),
        )
        for row in finished.rows
    ]
    legend = "range, angle: largest error; shape: farthest distance with the right one, mm; readings: number."
    return "\n\n".join([f"# Simulation {finished.trial}", legend, _table(head, rows)])


def _claimed(row: ClaimRow, value: float | None) -> str:
    return _number(value, ".2%" if row.quantity in {"range", "angle"} else ".0f")


def _trial_row(row: TrialRow) -> tuple[str, ...]:
    return (
        f"{row.standoff_mm:g}",
        str(row.readings),
        str(row.missing),
        *(_number(value, "+.2f") for value in (row.mean_error_mm, row.max_error_mm, row.min_error_mm)),
        *(_number(value, ".2f") for value in (row.sd_mm, row.range_sd_mm, row.reference_sd_mm)),
    )


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _without_range(readings: Iterable[ReadingTaken]) -> list[str]:
    missing = [
        f"{one.standoff_mm:g} mm, reading {one.reading}: {one.status}"
        for one in readings
        if one.range_mm is None
    ]
    return [_bullets("Readings without a range", missing)] if missing else []


def _bullets(title: str, lines: Iterable[str]) -> str:
    items = "\n".join(f"- {line}" for line in lines)
    return f"**{title}**\n\n{items}" if items else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, rule, *rows))
