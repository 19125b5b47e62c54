"""A session that is killed at any record ends, resumed, as one that was not."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import pytest

from tests.crash.short import GROUP, ROOT, begin, go_on, results, story, write_files
from workbench.model import event as ev
from workbench.session.journal import read_journal

RECORDS = 46
"""Of the short procedure; a test holds this number to it."""


@dataclass(frozen=True)
class Killer:
    """The process that runs sessions which kill themselves."""

    files: Path
    requests: IO[str]
    replies: IO[str]

    def run(self, session: Path, how: str, n: int) -> int:
        """Run or resume a session that dies; the signal that it died of, 0 where it did not."""
        request = {"files": str(self.files), "session": str(session), "how": how, "n": n}
        self.requests.write(json.dumps(request) + "\n")
        self.requests.flush()
        return int(self.replies.readline())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    write_files(folder)
    begin(folder, folder / "s")
    return folder / "s"


@pytest.fixture(scope="module")
def killer(whole: Path) -> Iterator[Killer]:
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.crash.killer"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    with process:
        yield Killer(whole.parent, process.stdin, process.stdout)


def captures(session: Path) -> Counter[str]:
    """How often each capture was taken."""
    taken = [r.event for r in read_journal(session) if isinstance(r.event, ev.CaptureTaken)]
    return Counter(e.on.sha256 + str(e.on.time_ns) for e in taken)


def assert_same(session: Path, whole: Path) -> None:
    assert results(session) == results(whole)
    assert story(session) == story(whole)


def test_the_number_of_records(whole: Path) -> None:
    assert len(list(read_journal(whole))) == RECORDS


@pytest.mark.parametrize(
    ("how", "n"), [("torn", n) for n in range(RECORDS)] + [("after", n) for n in range(0, RECORDS, 5)]
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


@pytest.mark.parametrize(("first", "second"), [(9, 12), (9, 18), (14, 16), (32, 33), (36, 40)])
def test_killed_again_while_it_goes_on(
    tmp_path: Path, whole: Path, killer: Killer, first: int, second: int
) -> None:
    session = tmp_path / "s"
    assert killer.run(session, "after", first) == signal.SIGKILL
    assert killer.run(session, "torn", second) == signal.SIGKILL
    go_on(session)
    assert_same(session, whole)
