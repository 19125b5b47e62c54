"""Runs sessions that kill themselves. `python -m tests.crash.killer`, one request a line on standard input.

A request is JSON: folder of the files, session, how it dies, and at which record. Each is a process of its
own, forked from this one, which has imported everything but started no thread: that is what makes it quick.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any
from unittest.mock import patch

import numpy as np

from tests.crash.short import ROOT, begin, go_on
from workbench.model import event as ev
from workbench.session.journal import Journal
from workbench.spots import find_spots


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


@contextmanager
def serving(files: Path) -> Iterator[Killer]:
    """The process for sessions of the files in a folder."""
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
        yield Killer(files, process.stdin, process.stdout)


def die() -> None:
    """As the power does: nothing is flushed, nothing is closed."""
    os.kill(os.getpid(), signal.SIGKILL)


def kill_after(n: int) -> ev.Consumer:
    """Die when record `n` is written."""

    def consumer(record: ev.Record) -> None:
        if record.n == n:
            die()

    return consumer


def tear(n: int) -> None:
    """Die in the middle of writing record `n`: all that it tells of is on disk, half of its line too."""
    whole = Journal.append

    def append(journal: Journal, event: ev.Event) -> ev.Record:
        if journal._next == n:
            os.write(journal._file, b'{"n":%d,"time_ns":17' % n)
            die()
        return whole(journal, event)

    patch.object(Journal, "append", append).start()  # to the end of this process


def run_and_die(request: dict[str, Any]) -> None:
    """Serve one request, in a process of its own."""
    session, n = Path(request["session"]), request["n"]
    if request["how"] == "torn":
        tear(n)
    consumers = [kill_after(n)] if request["how"] == "after" else []
    if session.exists():
        go_on(session, consumers)
    else:
        begin(Path(request["files"]), session, consumers)


def main() -> None:
    """Answer each request with the signal that ended it, 0 where it came to its end."""
    find_spots(np.zeros((48, 64), np.uint8))  # compiled once, for all that are forked
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            run_and_die(json.loads(line))
            os._exit(0)
        _, status = os.waitpid(child, 0)
        print(os.WTERMSIG(status) if os.WIFSIGNALED(status) else -os.WEXITSTATUS(status), flush=True)


if __name__ == "__main__":
    main()
