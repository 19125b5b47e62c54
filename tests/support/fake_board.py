"""Stands for NI's package `nidaqmx`, at its boundary: a board whose lines are a log file.

Only what the guardian calls is there, refused where the real one refuses it. What the board does wrong is the
word in the file `<log>.fault`: `unplugged`, `broken pipe` (an error not of the package), `stuck`.
"""

from __future__ import annotations

from pathlib import Path

FILES = {
    "__init__.py": """
import os, time
from pathlib import Path
from types import SimpleNamespace
from nidaqmx import errors
from nidaqmx.constants import LineGrouping

LOG = Path(os.environ["FAKE_BOARD_LOG"])


def fault():
    file = Path(f"{LOG}.fault")
    return file.read_text() if file.exists() else ""


def fail_if_gone():
    if fault() == "unplugged":
        raise errors.DaqError("Device is not available for this operation.")
    if fault() == "broken pipe":
        raise OSError("the driver's service has ended")


class Channels:
    def __init__(self, task):
        self._task = task

    def add_do_chan(self, lines, name_to_assign_to_lines="", line_grouping=LineGrouping.CHAN_FOR_ALL_LINES):
        if not lines.startswith("Dev1/port0/line"):
            raise errors.DaqError(f"Physical channel specified does not exist on this device: {lines}")
        first, _, last = lines.removeprefix("Dev1/port0/line").partition(":")
        assert line_grouping is LineGrouping.CHAN_PER_LINE
        self._task.number_of_channels = int(last or first) - int(first) + 1
        self._task.levels = [True] * self._task.number_of_channels  # whatever somebody left


class Task:
    def __init__(self):
        if fault() == "no driver":
            raise errors.DaqNotFoundError("Could not find an installation of NI-DAQmx.")
        self.do_channels = Channels(self)
        self.devices = [SimpleNamespace(product_type="PCI-6503", name="Dev1")]

    def write(self, data, auto_start=False, timeout=10.0):
        fail_if_gone()
        levels = data if isinstance(data, list) else [data]
        assert isinstance(data, list) == (self.number_of_channels > 1)
        assert auto_start and all(type(level) is bool for level in levels), levels
        assert len(levels) == self.number_of_channels
        if fault() == "stuck":
            Path(f"{LOG}.tried").touch()
        else:
            self.levels = levels
            mask = sum(1 << n for n, level in enumerate(levels) if level)
            with LOG.open("a") as file:
                file.write(f"{time.monotonic_ns()} {mask}\\n")
        return 1

    def read(self):
        fail_if_gone()
        return list(self.levels) if self.number_of_channels > 1 else self.levels[0]
""",
    "errors.py": """
class Error(Exception):
    pass


class DaqNotFoundError(Error):
    pass


class DaqError(Error):
    pass
""",
    "constants.py": """
from enum import Enum


class LineGrouping(Enum):
    CHAN_PER_LINE = 0
    CHAN_FOR_ALL_LINES = 1
""",
}


def write_package(folder: Path) -> None:
    """Make it importable from `folder`."""
    (folder / "nidaqmx").mkdir(parents=True)
    for name, text in FILES.items():
        (folder / "nidaqmx" / name).write_text(text)


def changes(log: Path) -> list[tuple[int, int]]:
    """(time, ns of the monotonic clock; mask of the lines) of every write so far."""
    whole = log.read_text().rpartition("\n")[0].splitlines() if log.exists() else []
    return [(int(time_ns), int(mask)) for time_ns, mask in (line.split() for line in whole)]
