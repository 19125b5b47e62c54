"""Placements of the target, one after the other: asked for, worked at, repeated, left out, or served."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from workbench.model import event as ev
from workbench.model.prompt import Answer, Prompt
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.prompts import placement_prompt
from workbench.session.frames import FrameStore

T = TypeVar("T")


class RetakeError(Exception):
    """What was captured at the present placement is to be captured again; says why."""

    def __init__(self, why: str, by_limit: bool = False) -> None:
        super().__init__(why)
        self.by_limit = by_limit
        """Nobody was asked."""


class _ServedAgainError(Exception):
    """What a resumed session had on disk of the present placement is to be captured again."""


class _LeftOutError(Exception):
    """The present placement is to be left out."""

    def __init__(self, answer: Answer) -> None:
        super().__init__()
        self.answer = answer


def visit_placements(
    context: Context, placements: Sequence[Placement], work: Callable[[Placement], T], *, lights: bool = True
) -> list[T]:
    """Have the target placed at one placement after the other, and do the `work` at each.

    The operator may skip one, or have the one before captured again. What is done at a placement is a
    group: a resumed session serves whole ones from disk, and repeats the one that was under way.

    Args:
        context: the session.
        placements: where the target is to stand; their keys differ.
        work: gets the placement as measured; takes every capture under its key.
        lights: whether it captures spots, and so needs the exposure set for them.

    Returns:
        What `work` returned, for the placements that were not skipped. Where results are grouped, `work`
        returns the placement's key with them: its standoff is as measured.

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
        context.pairs.served = context.recorder.group(asked.key)
        answer = _place_answer(context, asked, before)
        if answer.action == "redo" and before is not None:
            _set_aside(context, before.key, began.pop(before.key), answer.reason or "")
            results.pop(before.key, None)
            index -= 1
            continue
        index += 1
        if answer.action == "skip":
            _tell_skipped(context, asked, answer)
            continue
        record, placed = _place(context, asked, answer)
        began[asked.key] = record.n
        try:
            results[asked.key] = _work(context, work, placed, record.n, answer)
        except _ServedAgainError:  # the target is not known to stand there, nor the beams to be free
            del began[asked.key]
            index -= 1
        except _LeftOutError as left_out:
            del began[asked.key]
            _tell_skipped(context, asked, left_out.answer)
        else:
            context.pairs.look_for_stuck_beam(asked.key)
            context.emit(ev.PlacementFinished(key=asked.key))
        context.pairs.served = None
    return list(results.values())


def _work(
    context: Context, work: Callable[[Placement], T], placed: Placement, from_n: int, answer: Answer
) -> T:
    """Do the work at a placement, again where it asks for that."""
    while True:
        try:
            return work(placed)
        except RetakeError as again:
            _set_aside(context, placed.key, from_n, str(again), retry=again.by_limit)
            if context.pairs.served is not None:
                raise _ServedAgainError from again
            FrameStore(context.session_dir).set_aside(placed.key)
            from_n = context.emit(ev.TargetPlaced(placement=placed, by=answer.by)).n
        except _LeftOutError as left_out:
            _set_aside(context, placed.key, from_n, left_out.answer.reason or "", left_out=True)
            raise


def _exposed(context: Context, work: Callable[[Placement], T]) -> Callable[[Placement], T]:
    """The work with the camera's exposure set before it."""

    def do(placed: Placement) -> T:
        if (found := context.pairs.set_exposure(placed.key, context.begin)) is not None:
            context.emit(found)
        return work(placed)

    return do


def _tell_skipped(context: Context, asked: Placement, answer: Answer) -> None:
    context.emit(ev.Answered(key=asked.key, question=f"{asked.standoff_mm:g} mm", answer=answer))


def _place_answer(context: Context, asked: Placement, before: Placement | None) -> Answer:
    if context.pairs.served is not None:
        return Answer()
    known = context.recorder.answer(asked.key)
    if known is not None and known.action == "skip":
        return known
    context.confirm_safety()
    return context.ask_now(placement_prompt(asked, before))


def _place(context: Context, asked: Placement, answer: Answer) -> tuple[ev.Record, Placement]:
    """The target stands; what stood in frames of an earlier try is moved aside."""
    if context.pairs.served is not None:
        return context.emit(context.pairs.served.placed), context.pairs.served.placed.placement
    FrameStore(context.session_dir).set_aside(asked.key)
    measured = answer.value if isinstance(answer.value, float) else asked.standoff_mm
    placed = context.bench.target.place(asked.model_copy(update={"standoff_mm": measured}))
    return context.emit(ev.TargetPlaced(placement=placed, by=answer.by)), placed


def _set_aside(
    context: Context, key: str, from_n: int, reason: str, *, retry: bool = False, left_out: bool = False
) -> None:
    """Forget what was captured at a placement; its frames are kept, moved aside when it is repeated."""
    context.emit(ev.SetAside(key=key, from_n=from_n, reason=reason, retry=retry, left_out=left_out))
    context.forget(key)


def settle(context: Context, prompt: Prompt, failed: str) -> None:
    """Ask what to do about a limit that failed at the present placement; returns where it is kept.

    Raises:
        RetakeError: it is to be captured again.
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    answer = context.recorder.answer(prompt.key) or context.ask_now(prompt)
    if answer.action == "redo":
        raise RetakeError(f"{failed}: {answer.reason}")
    if answer.action == "skip":
        raise _LeftOutError(answer)
    context.emit(ev.Answered(key=prompt.key, question=prompt.do, answer=answer))
