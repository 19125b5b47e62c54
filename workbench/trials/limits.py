"""Limits on the results of a trial, decided with guard bands (ISO 14253-1), and missing results."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from workbench.model.errors import LimitFailedError
from workbench.model.event import LimitChecked, ReadingTaken
from workbench.model.limit import Limit, Verdict
from workbench.model.table import Cell
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import result_limit_prompt, stated_limits
from workbench.trials.errors import ErrorStatistics, range_statistics
from workbench.trials.statistics.decision import Decision, decide

MOST_SHOWN = 3
"""Largest number of failed results in a message."""


@dataclass(frozen=True)
class Result:
    """One quantity of a trial's result, in the unit of its name."""

    quantity: str
    """Name of the limit."""
    of: str
    """Subject of the result, for example `500 mm`."""
    value: float | None
    """None: not measured, which fails every limit unless the operator skipped the placement."""
    low: float | None = None
    """Lower end of the 95 % interval; None: the value has no uncertainty."""
    high: float | None = None
    is_skipped: bool = field(default=False, kw_only=True)
    """Whether the operator skipped the placement: neither conformity nor non-conformity."""

    @classmethod
    def of_error(cls, quantity: str, of: str, error: float | None, expanded: float | None) -> Result:
        """Result with the interval error +- expanded uncertainty."""
        if error is None or expanded is None:
            return cls(quantity, of, error)
        return cls(quantity, of, error, error - expanded, error + expanded)

    def decision(self, limit: Limit) -> Decision:
        """Decision against a limit with guard bands."""
        if self.is_skipped:
            return "neither"
        if self.value is None:
            return "fail"
        low = self.value if self.low is None else self.low
        return decide(limit.within, low, self.value if self.high is None else self.high)

    def verdict(self, limit: Limit) -> Verdict:
        """Verdict for the journal; `marginal`: neither conformity nor non-conformity, or a remark."""
        if (found := self.decision(limit)) == "pass":
            return limit.judge(self.value)
        return "fail" if found == "fail" else "marginal"


def decision_on(results: Sequence[Result], limits: FileModel) -> Decision | None:
    """Decision on results together; None without a limit on any of them.

    `fail` if one fails, `pass` if all pass, else `neither`.
    """
    named = dict(stated_limits(limits))
    found = {one.decision(named[one.quantity]) for one in results if one.quantity in named}
    if not found:
        return None
    return "fail" if "fail" in found else "neither" if "neither" in found else "pass"


def skipped_results(skipped: Sequence[Placement], limits: FileModel) -> list[Result]:
    """Results of skipped placements, one for each limit: without them no limit is decided to be kept."""
    return [
        Result(name, f"{placement.standoff_mm:.6g} mm, skipped", None, is_skipped=True)
        for name, _ in stated_limits(limits)
        for placement in skipped
    ]


def check_results(context: Context, step: str, results: Sequence[Result], limits: FileModel) -> str:
    """Compare the results of a trial with the limits of the same names; returns a summary.

    Args:
        context: session; its operator is asked if a limit has `on_fail: ask`.
        step: name of the step.
        results: results; several may have the same quantity.
        limits: limits of the step by quantity.

    Raises:
        LimitFailedError: a limit failed and ends the session.
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    remarks = []
    for name, limit in stated_limits(limits):
        own = [one for one in results if one.quantity == name]
        if all(one.is_skipped for one in own):
            own.append(Result(name, "trial", None))
        _journal(context, step, own, limit)
        if failed := [one for one in own if one.verdict(limit) == "fail"]:
            text = f"{name}: expected {limit.describe()}, got {_values(failed)}"
            if limit.on_fail == "stop":
                raise LimitFailedError(f"{step}: {text}")
            context.ask(result_limit_prompt(step, name, text))
            remarks.append(text)
    if not dict(stated_limits(limits)):
        return ""
    if remarks:
        return "; ".join(remarks)
    return (
        "within the limits" if decision_on(results, limits) == "pass" else "neither within nor outside limits"
    )


def error_result(quantity: str, of: str, statistics: ErrorStatistics) -> Result:
    """Mean error at one set-up with its expanded uncertainty."""
    return Result.of_error(quantity, of, statistics.mean, statistics.expanded)


def range_results(of: str, readings: Sequence[ReadingTaken]) -> list[Result]:
    """Mean error of the range at one set-up, in mm and relative to the true range."""
    found, true_mm = range_statistics(readings), readings[0].reference_mm
    relative = [None if one is None else one / true_mm for one in (found.mean, found.expanded)]
    return [
        error_result("range_error_mm", of, found),
        Result.of_error("relative_range_error", of, relative[0], relative[1]),
    ]


def cell_number(cell: Cell) -> float | None:
    """Number in a cell of a table; None for an empty one or a text."""
    return float(cell) if isinstance(cell, float | int) else None


def require_readings(step: str, readings: Iterable[Sequence[ReadingTaken]]) -> None:
    """Check that every placement has a reading with a range.

    Args:
        step: name of the step.
        readings: readings at each placement that was not skipped.

    Raises:
        LimitFailedError: no placement was captured, or all readings at one have no range.
    """
    taken = list(readings)
    if not taken:
        raise LimitFailedError(f"{step}: expected readings, got none: every placement was skipped")
    empty = [of for of in taken if all(one.range_mm is None for one in of)]
    if empty:
        causes = "; ".join(dict.fromkeys(f"{of[0].reference_mm:.6g} mm: {of[0].cause}" for of in empty))
        raise LimitFailedError(
            f"{step}: expected a range at each of {len(taken)} placements, none at {len(empty)}: {causes}."
            " Check target and lasers there, then run the trial again"
        )


def _journal(context: Context, step: str, results: Sequence[Result], limit: Limit) -> None:
    for one in results:
        context.emit(
            LimitChecked(
                step=step,
                of=one.of,
                quantity=one.quantity,
                value=one.value,
                limit=limit.describe(),
                verdict=one.verdict(limit),
            )
        )


def _values(failed: Sequence[Result]) -> str:
    shown = [f"{_value(one)} ({one.of})" for one in failed[:MOST_SHOWN]]
    more = len(failed) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def _value(one: Result) -> str:
    if one.value is None:
        return "no value"
    if one.low is None or one.high is None:
        return f"{one.value:.4g}"
    return f"{one.value:.4g} (95 %: {one.low:.4g} to {one.high:.4g})"
