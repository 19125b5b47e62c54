"""Text documents about a capture, a fit and a trial."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.model.event import CaptureTaken, FitFinished, ReadingTaken
from workbench.model.prompt import Prompt
from workbench.model.table import Table

MOST_LINES = 6
"""Largest number of reasons or warnings in a summary; the checks list all."""


def capture_line(number: int, capture: CaptureTaken, step: str) -> str:
    """Number, standoff, laser and exposure of a capture in Markdown: the text at the time cursor."""
    laser = "all lasers" if capture.laser_id == "all" else capture.laser_id
    off = f" without {', '.join(capture.left_off)}" if capture.left_off else ""
    exposure = (
        "" if capture.exposure is None else f", exposure {capture.exposure:g} {capture.exposure_unit or ''}"
    )
    return (
        f"**Capture {number}: {capture.standoff_mm:g} mm, {laser}{off}**, repeat {capture.repeat}"
        f"{exposure.rstrip()}  \n{step}"
    )


def task_text(step: str, prompt: Prompt | None) -> str:
    """Present step, and below it an open prompt with what to see and what to do otherwise, in Markdown."""
    if prompt is None:
        return step
    lines = [step, f"**> {prompt.do}**"]
    if prompt.expect:
        lines.append(f"Expected: {prompt.expect}")
    if prompt.otherwise:
        lines.append(f"Otherwise: {prompt.otherwise}")
    return "\n\n".join(line for line in lines if line)


def fit_summary(fit: FitFinished, defects: Table) -> str:
    """Verdict of a fit in Markdown: the named faults or reasons first, then defects of captures."""
    head = (
        f"**Calibration {fit.verdict}**: {fit.rms_px:.3f} px rms, {fit.observations} spots,"
        f" {len(fit.rejected)} not used"
    )
    causes = [fault.message for fault in fit.faults]
    others = [reason for reason in fit.reasons if reason not in causes]
    bad = [
        f"{laser} at {mm:g} mm: {defect} (captures {numbers})" for mm, laser, defect, numbers in defects.rows
    ]
    lines = [head, *_bullets([*causes, *others]), *_bullets(bad), *_bullets(fit.warnings)]
    return "\n\n".join(lines)


def without_range(readings: Iterable[ReadingTaken]) -> str:
    """List of readings without a range, one line each; empty if all have one."""
    missing = [
        f"{one.standoff_mm:g} mm, reading {one.reading}: {one.cause}"
        for one in readings
        if one.range_mm is None
    ]
    return "\n".join(["Readings without a range", *missing]) if missing else ""


def _bullets(lines: Iterable[str]) -> list[str]:
    items = list(dict.fromkeys(lines))
    shown = [f"- {item}" for item in items[:MOST_LINES]]
    if len(items) > MOST_LINES:
        shown.append(f"- and {len(items) - MOST_LINES} more, see Checks")
    return ["\n".join(shown)] if shown else []
