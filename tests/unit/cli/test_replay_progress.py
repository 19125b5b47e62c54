"""Progress of a replay."""

from __future__ import annotations

import pytest

from tests.support.records import placed, records, shot
from workbench.cli.replay_progress import ReplayProgress
from workbench.model import event as ev


def progress(kept: dict[str, int], *timed: tuple[float, ev.Event]) -> ReplayProgress:
    """Progress after events at stated times, s."""
    times = iter(
        [at_s for at_s, event in timed if isinstance(event, ev.CaptureTaken) and event.key[0] in kept]
    )
    found = ReplayProgress(kept, lambda: next(times))
    for record in records(*timed):
        found.take(record)
    return found


def test_the_time_left_follows_from_the_pace_so_far() -> None:
    found = progress({"a": 2, "c": 4}, (0, placed("a")), *shot(10, "a1"), *shot(13, "a2"))
    assert (found.done, found.total) == (2, 6)
    assert found.seconds_left == pytest.approx(4 * 3.0)


def test_new_captures_and_their_prompts_do_not_count() -> None:
    session = (*shot(10, "a1"), *shot(12, "a2"), *shot(500, "b1"), *shot(600, "c1"), *shot(604, "c2"))
    found = progress({"a": 2, "c": 4}, *session)
    assert (found.done, found.total) == (4, 6)
    assert found.seconds_left == pytest.approx(2 * (2.0 + 4.0) / 2)


def test_a_placement_that_is_captured_again_after_all_is_not_replayed() -> None:
    again = (20, ev.SetAside(key="a", from_n=0, reason="moved"))
    found = progress({"a": 2, "c": 4}, *shot(10, "a1"), again)
    assert (found.done, found.total) == (0, 4)
    assert found.keeps("c")
    assert not found.keeps("a")


def test_one_capture_has_no_pace() -> None:
    assert progress({"a": 2}, *shot(10, "a1")).seconds_left is None
