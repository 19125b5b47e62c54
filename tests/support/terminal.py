"""The installed command at a pseudo-terminal, driven like a person does."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from tests.support.command_line import SCRIPT

AT_TERMINAL = """
import os, sys
tty = os.open(sys.argv[1], os.O_RDWR)  # the first that the leader of a session opens is its terminal
for handle in range(3):
    os.dup2(tty, handle)
os.execv(sys.argv[2], sys.argv[2:])
"""


@dataclass
class Terminal:
    """A session at a pseudo-terminal of its own."""

    process: subprocess.Popen[bytes]
    master: int
    text: str = field(default="")
    seen: int = 0

    def wait_for(self, words: str) -> None:
        """Read on until these words come, after what was waited for before."""
        deadline = time.monotonic() + 120
        while words not in self.text[self.seen :]:
            assert time.monotonic() < deadline, self.text
            if select.select([self.master], [], [], 0.2)[0]:
                self.text += os.read(self.master, 65536).decode()
        self.seen = self.text.index(words, self.seen) + len(words)

    def type(self, line: str) -> None:
        """Answer a prompt, once it is there."""
        self.wait_for("> ")
        os.write(self.master, line.encode() + b"\n")

    def end(self) -> int:
        """Wait for the end, and read the rest."""
        deadline = time.monotonic() + 120
        while self.process.poll() is None:
            assert time.monotonic() < deadline, self.text
            if select.select([self.master], [], [], 0.1)[0]:
                try:
                    self.text += os.read(self.master, 65536).decode()
                except OSError:
                    break
        return self.process.wait(60)


@contextmanager
def at_terminal(folder: Path, *arguments: str, columns: int = 80) -> Iterator[Terminal]:
    """The command `workbench` in a folder, at a terminal of its own; it is killed if it is still running."""
    master, slave = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "CI"}
    process = subprocess.Popen(
        [sys.executable, "-c", AT_TERMINAL, os.ttyname(slave), str(SCRIPT), *arguments],
        cwd=folder,
        env=environment | {"COLUMNS": str(columns)},
        start_new_session=True,
    )
    try:
        yield Terminal(process, master)
    finally:
        os.close(slave)
        if process.poll() is None:
            process.kill()
            process.wait()
        with suppress(OSError):
            os.close(master)


def plain_lines(text: str) -> list[str]:
    """Lines as they were printed, without colours and without the lines of the progress display."""
    lines = text.replace("\r\n", "\n").split("\n")
    return [re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", line.rsplit("\r", 1)[-1]) for line in lines]
