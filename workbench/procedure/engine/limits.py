"""Comparison of measured quantities with a procedure's limits, and the reaction to a failure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

from workbench.model import event as ev
from workbench.model.errors import LimitFailedError
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.capture.quality import CaptureLimits, quality_of
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import RetakeError, settle
from workbench.procedure.engine.prompts import captures_prompt

Limits = TypeVar("Limits", bound=FileModel)
CONTINUE = "Continue nevertheless?"
RETRIES = 2
"""Number of times that `on_fail: retry` captures a placement again in a session."""


def capture_limit_prompts(placements: Sequence[Placement], rig: Rig, limits: CaptureLimits) -> list[Prompt]:
    """Possible prompts of limits with `on_fail: ask`, for each laser at each placement."""
    return [
        captures_prompt(f"{placement.key}/{laser_id}/{name}", name, placement)
        for placement in placements
        for laser_id in rig.laser_ids
        for name in _asking(limits)
    ]


def result_limit_prompts(step: str, limits: FileModel) -> list[Prompt]:
    """Possible prompts of limits on results of a fit or a trial with `on_fail: ask`."""
    return [result_limit_prompt(step, name) for name in _asking(limits)]


def result_limit_prompt(step: str, name: str, failed: str = "") -> Prompt:
    """Question about a failed limit on a result of a fit or a trial.

    Args:
        step: name of the step.
        name: name of the limit.
        failed: description of the failure; empty: it is not known yet.
    """
    question = f"{failed}. {CONTINUE}" if failed else CONTINUE
    return Prompt(f"{step}/{name}", question, otherwise="Abort with a reason.", overrules=True)


def refuse_retry(limits: Limits) -> Limits:
    """Validate limits on results of a fit or a trial, which would be the same after a retry.

    Raises:
        ValueError: a limit has `on_fail: retry`.
    """
    for name, limit in stated_limits(limits):
        if limit.on_fail == "retry":
            raise ValueError(
                f"{name}: on_fail: expected ask or stop, got retry; a retry gives the same result"
            )
    return limits


def check_captures(context: Context, step: str, placement: Placement, limits: CaptureLimits) -> None:
    """Compare the captures of each laser at a placement with limits.

    Args:
        context: session; its operator is asked if a limit has `on_fail: ask`.
        step: name of the step.
        placement: placement of the captures.
        limits: limits of the step.

    Raises:
        RetakeError: the placement must be captured again.
        LimitFailedError: a limit failed and ends the session.
    """
    for laser_id in context.rig.laser_ids:
        keys = [c.key for c in context.captures if (c.placement_key, c.laser_id) == (placement.key, laser_id)]
        found = [context.findings[key].spots for key in keys]
        quality = quality_of(found)
        missing, answered = quality.u_px is None, False
        for name, limit in stated_limits(limits):
            of = f"{placement.key}/{laser_id}"
            why = why_not_measured(name, laser_id, [len(spots) for spots in found])
            failed = _check(context, step, of, name, getattr(quality, name), limit, f"none: {why}")
            if failed is None or (missing and answered and limit.on_fail == "ask"):
                continue  # a missing spot fails several limits: ask once
            if limit.on_fail == "retry" and context.recorder.retries(placement.key) < RETRIES:
                raise RetakeError(failed, by_limit=True)
            where = _expected_position(context, laser_id, placement) if missing else ""
            if limit.on_fail != "ask":
                raise LimitFailedError(f"{failed}. {where}" if missing else failed)
            shown = f"{why} at {placement.standoff_mm:g} mm ({name}: expected {limit.describe()})"
            question = captures_prompt(f"{of}/{name}", shown if missing else failed, placement, where)
            settle(context, question, failed)
            answered = True


def check_fit(context: Context, step: str, values: Mapping[str, float], limits: FileModel) -> str:
    """Compare quantities of a fit with the limits of the same names; returns a summary.

    Raises:
        LimitFailedError: a limit failed and ends the session.
        StoppedError: the operator aborts at a failed limit.
    """
    remarks = []
    for name, limit in stated_limits(limits):
        failed = _check(context, step, "fit", name, float(values[name]), limit)
        if failed is None:
            continue
        if limit.on_fail == "stop":
            raise LimitFailedError(failed)
        context.ask(result_limit_prompt(step, name, failed))
        remarks.append(failed)
    return "; ".join(remarks) or "within the limits"


def _check(
    context: Context,
    step: str,
    of: str,
    quantity: str,
    value: float | None,
    limit: Limit,
    otherwise: str = "",
) -> str | None:
    """Journal the verdict; returns a description of a failure, with `otherwise` for a missing value."""
    verdict = limit.judge(value)
    context.emit(
        ev.LimitChecked(
            step=step, of=of, quantity=quantity, value=value, limit=limit.describe(), verdict=verdict
        )
    )
    got = otherwise if value is None else f"{value:.4g}"
    return f"{of}: {quantity}: expected {limit.describe()}, got {got}" if verdict == "fail" else None


def _asking(limits: FileModel) -> Iterator[str]:
    return (name for name, limit in stated_limits(limits) if limit.on_fail == "ask")


def stated_limits(limits: FileModel) -> Iterator[tuple[str, Limit]]:
    """Limits of a model that are not None, with their names."""
    return ((name, limit) for name, limit in limits if limit is not None)


def why_not_measured(quantity: str, laser_id: str, spots: Sequence[int]) -> str:
    """Reason why a quantity could not be measured.

    Args:
        quantity: name of the quantity.
        laser_id: laser of the captures.
        spots: number of spots in each capture.
    """
    captures = counted(len(spots), "capture")
    if 1 in spots:
        return f"{quantity} requires a spot of {laser_id} in at least two captures"
    if any(spots):
        return f"{laser_id} is ambiguous among up to {max(spots)} spots in {captures}"
    return f"no spot of {laser_id} was found in {captures}"


def _expected_position(context: Context, laser_id: str, placement: Placement) -> str:
    # Imported here: checking a file must not import the solver.
    from workbench.procedure.engine.observed import expected_position_text

    return expected_position_text(context, laser_id, placement)
