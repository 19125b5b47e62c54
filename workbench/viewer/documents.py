"""Text documents about a fit and a trial."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.model.event import (
    FitFinished,
    ReadingTaken,
)


def fit_summary(fit: FitFinished) -> str:
    """Summary of a fit in Markdown: verdict, reasons, warnings, residual."""
    lines = [
        f"**Calibration {fit.verdict}**",
        _bullets("Reasons", fit.reasons),
        _bullets("Warnings", fit.warnings),
        f"**Residual** {fit.rms_px:.3f} px rms over {fit.observations} observations, "
        f"{len(fit.rejected)} rejected.",
    ]
    return "\n\n".join(line for line in lines if line)


def without_range(readings: Iterable[ReadingTaken]) -> str:
    """List of readings without a range, one line each; empty if all have one."""
    missing = [
        f"{one.standoff_mm:g} mm, reading {one.reading}: {one.cause}"
        for one in readings
        if one.range_mm is None
    ]
    return "\n".join(["Readings without a range", *missing]) if missing else ""


def _bullets(title: str, lines: Iterable[str]) -> str:
    items = "\n".join(f"- {line}" for line in lines)
    return f"**{title}**\n\n{items}" if items else ""
