"""Placements of the target, one after the other: captured, captured again, skipped, or replayed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from workbench.model import event as ev
from workbench.model.prompt import Answer, Prompt
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.prompts import placement_prompt
from workbench.session.frames import FrameStore

T = TypeVar("T")


class RetakeError(Exception):
    """Request to capture the present placement again; the text is the reason."""

    def __init__(self, why: str, by_limit: bool = False, place_again: bool = False) -> None:
        super().__init__(why)
        self.by_limit = by_limit
        """Whether a limit with `on_fail: retry` is the cause, not the operator."""
        self.place_again = place_again
        """Whether the target must be placed, and its standoff entered, again."""


class _PlaceAgainError(Exception):
    """Request to capture a placement again for which the target must be placed first."""


class _SkipError(Exception):
    """Request to skip the present placement."""

    def __init__(self, answer: Answer) -> None:
        super().__init__()
        self.answer = answer


def visit_placements(
    context: Context,
    placements: Sequence[Placement],
    work: Callable[[Placement], T],
    *,
    lights: bool = True,
    expect: Mapping[str, str] | None = None,
) -> list[T]:
    """Ask for the target at one placement after the other and do the `work` at each.

    The operator may skip a placement or request the previous one again. A resumed session replays complete
    placements from disk and repeats the one that was under way.

    Args:
        context: session.
        placements: placements of the target, with distinct keys.
        work: called with the placement as measured; must take its captures under the placement's key.
        lights: whether the work captures spots, so that the exposure must be set before.
        expect: further sentences about what the operator will see, by key of the placement.

    Returns:
        Results of `work` for the placements that were not skipped. A placement's standoff is as measured, so
        results that are grouped by placement should contain its key.

    Raises:
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    work = _exposed(context, work) if lights else work
    results: dict[str, T] = {}
    began: dict[str, int] = {}
    index = 0
    while index < len(placements):
        asked = placements[index]
        before = placements[index - 1] if index and placements[index - 1].key in began else None
        context.pairs.replayed = context.recorder.complete_placement(asked.key)
        answer = _place_answer(context, asked, before, (expect or {}).get(asked.key, ""))
        if answer.action == "redo" and before is not None:
            _set_aside(context, before.key, began.pop(before.key), answer.reason or "")
            results.pop(before.key, None)
            index -= 1
            continue
        index += 1
        if answer.action == "skip":
            _journal_skip(context, asked, answer)
            continue
        record, placed = _place(context, asked, answer)
        began[asked.key] = record.n
        try:
            results[asked.key] = _work(context, work, placed, record.n, answer)
        except _PlaceAgainError:
            del began[asked.key]
            index -= 1
        except _SkipError as skip:
            del began[asked.key]
            _journal_skip(context, asked, skip.answer)
        else:
            context.pairs.check_stuck_beam(asked.key)
            context.emit(ev.PlacementFinished(key=asked.key))
        context.pairs.replayed = None
    return list(results.values())


def _work(
    context: Context, work: Callable[[Placement], T], placed: Placement, from_n: int, answer: Answer
) -> T:
    """Call the work at a placement, again if it requests that."""
    while True:
        context.continue_clock()
        try:
            return work(placed)
        except RetakeError as again:
            _set_aside(context, placed.key, from_n, str(again), retry=again.by_limit)
            # Of a replayed placement neither the target's position nor a free beam path is known.
            if again.place_again or context.pairs.replayed is not None:
                raise _PlaceAgainError from again
            FrameStore(context.session_dir).set_aside(placed.key)
            from_n = context.emit(ev.TargetPlaced(placement=placed, by=answer.by)).n
        except _SkipError as skip:
            _set_aside(context, placed.key, from_n, skip.answer.reason or "", left_out=True)
            raise


def _exposed(context: Context, work: Callable[[Placement], T]) -> Callable[[Placement], T]:
    """Work preceded by setting the camera's exposure."""

    def do(placed: Placement) -> T:
        if (found := context.pairs.set_exposure(placed, context.begin)) is not None:
            context.emit(found)
        return work(placed)

    return do


def _journal_skip(context: Context, asked: Placement, answer: Answer) -> None:
    context.emit(ev.Answered(key=asked.key, question=f"{asked.standoff_mm:g} mm", answer=answer))


def _place_answer(context: Context, asked: Placement, before: Placement | None, expect: str) -> Answer:
    if context.pairs.replayed is not None:
        return Answer()
    known = context.recorder.answer(asked.key)
    if known is not None and known.action == "skip":
        return known
    context.confirm_safety()
    prompt = placement_prompt(asked, before)
    return context.ask_now(replace(prompt, expect=f"{prompt.expect} {expect}".rstrip()))


def _place(context: Context, asked: Placement, answer: Answer) -> tuple[ev.Record, Placement]:
    """Place the target and journal it; frames of an earlier attempt are moved aside."""
    if context.pairs.replayed is not None:
        return context.emit(context.pairs.replayed.placed), context.pairs.replayed.placed.placement
    measured = answer.value if isinstance(answer.value, float) else asked.standoff_mm
    attempt = 1 + context.recorder.repairs.attempts[asked.key]
    wanted = asked.model_copy(update={"standoff_mm": measured, "attempt": attempt})
    placed = context.bench.target.place(wanted)
    # Not before the target stands there: until then the frames so far belong to valid records.
    FrameStore(context.session_dir).set_aside(asked.key)
    return context.emit(ev.TargetPlaced(placement=placed, by=answer.by)), placed


def _set_aside(
    context: Context, key: str, from_n: int, reason: str, *, retry: bool = False, left_out: bool = False
) -> None:
    """Make the records of a placement void; its frames are kept, and moved aside by the next attempt."""
    context.emit(ev.SetAside(key=key, from_n=from_n, reason=reason, retry=retry, left_out=left_out))
    context.forget(key)


def settle(context: Context, prompt: Prompt, failed: str, *, place_again: bool = False) -> None:
    """Ask what to do about a failed check at the present placement; returns if its captures are kept.

    Args:
        context: session.
        prompt: question.
        failed: description of the failure, for the record.
        place_again: whether `redo` asks for the target and its standoff again.

    Raises:
        RetakeError: the placement must be captured again.
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    answer = context.recorder.answer(prompt.key, prompt.do) or context.ask_now(prompt)
    if answer.action == "redo":
        raise RetakeError(f"{failed}: {answer.reason}", place_again=place_again)
    if answer.action == "skip":
        raise _SkipError(answer)
    context.journal_answer(prompt, answer)
