"""A session that is killed at any record ends, resumed, as one that was not."""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.crash.killer import Killer, serving
from tests.crash.short import GROUP, begin, go_on, results, story, with_small_pictures, write_files
from workbench.model import event as ev
from workbench.session.journal import read_journal

RECORDS = 46
"""Of the short procedure; a test holds this number to it."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    with_small_pictures(write_files(folder)[0])
    begin(folder, folder / "s")
    return folder / "s"


@pytest.fixture(scope="module")
def killer(whole: Path) -> Iterator[Killer]:
    with serving(whole.parent) as found:
        yield found


def captures(session: Path) -> Counter[str]:
    """How often each capture was taken."""
    taken = [r.event for r in read_journal(session) if isinstance(r.event, ev.CaptureTaken)]
    return Counter(e.on.sha256 + str(e.on.time_ns) for e in taken)


def assert_same(session: Path, whole: Path) -> None:
    assert results(session) == results(whole)
    assert story(session) == story(whole)


def test_the_number_of_records(whole: Path) -> None:
    assert len(list(read_journal(whole))) == RECORDS


QUICK = {*(("torn", n) for n in range(0, RECORDS, 5)), *(("after", n) for n in range(1, RECORDS, 15))}


@pytest.mark.parametrize(
    ("how", "n"),
    [
        pytest.param(how, n, marks=() if (how, n) in QUICK else pytest.mark.thorough)
        for how in ("torn", "after")
        for n in range(RECORDS)
    ],
)
def test_killed_at_a_record(tmp_path: Path, whole: Path, killer: Killer, how: str, n: int) -> None:
    session = tmp_path / "s"
    assert killer.run(session, how, n) == signal.SIGKILL
    before = len(list(read_journal(session)))
    assert before == (n + 1 if how == "after" else n)
    if before == RECORDS:
        return
    go_on(session)
    assert_same(session, whole)
    again = sum(captures(session).values()) - sum(captures(whole).values())
    assert 0 <= again <= GROUP, "at most the placement that was under way is captured again"


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (9, 18),
        (14, 16),
        (36, 40),
        *(pytest.param(*case, marks=pytest.mark.thorough) for case in ((9, 12), (32, 33))),
    ],
)
def test_killed_again_while_it_goes_on(
    tmp_path: Path, whole: Path, killer: Killer, first: int, second: int
) -> None:
    session = tmp_path / "s"
    assert killer.run(session, "after", first) == signal.SIGKILL
    assert killer.run(session, "torn", second) == signal.SIGKILL
    go_on(session)
    assert_same(session, whole)
