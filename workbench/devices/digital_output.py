"""The laser driver `nidaqmx`: lasers on the lines of a digital output board, by NI-DAQmx.

The board has no lease of its own: what was written stays until something else is written. The guardian, which
holds nothing longer than its lease, is all that puts the lasers off (docs/laser-controller.md).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError

PACKAGE = "nidaqmx"


class DigitalOutputBlock(DeviceBlock):
    """The block `devices: lasers:` of the rig file."""

    port: str
    """The board's lines, as `Dev1/port0/line0:3`."""


class DigitalOutputLine:
    """See `guarded_line.GuardedLine`; laser 1 is the first line."""

    settings_type: ClassVar = DigitalOutputBlock
    has_leases: ClassVar[bool] = False

    def __init__(self, settings: DigitalOutputBlock, lasers: int, alarm: Callable[[], bool]) -> None:
        """Reserve the board's lines and set them low.

        Raises:
            BadInputError: there are fewer of them than lasers.
            RigNotReadyError: the package or its driver is missing, or there are no such lines.
        """
        self._lines = lines = settings.port
        try:
            package = importlib.import_module(PACKAGE)
            constants = importlib.import_module(f"{PACKAGE}.constants")
        except ImportError as error:
            raise RigNotReadyError(
                f"lasers at {lines}: expected the package {PACKAGE}, got: {error};"
                f" install it with `pip install 'laser-range-workbench[{PACKAGE}]'`, and NI's driver with it"
            ) from None
        with self._asked("reserve the lines"):
            self._task: Any = package.Task()
            self._task.do_channels.add_do_chan(lines, line_grouping=constants.LineGrouping.CHAN_PER_LINE)
            self._count = int(self._task.number_of_channels)
            self._write(0)
        if self._count < lasers:
            raise BadInputError(
                f"lasers at {lines}: expected a line for each of the rig's {lasers} lasers, the board has"
                f" {self._count} there; name as many lines in the rig file (devices: lasers: port)"
            )

    def identify(self, boot_s: float) -> str:
        """Product and name of the board; it needs no time to boot.

        Raises:
            RigNotReadyError: it does not answer.
        """
        with self._asked("tell its name"):
            boards = [f"{device.product_type} {device.name}" for device in self._task.devices]
        return f"{', '.join(boards)}, {self._count} lines"

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off; the lease is the guardian's.

        Raises:
            RigNotReadyError: the board refuses.
        """
        with self._asked("set the lines"):
            self._write(mask)

    def all_off(self) -> None:
        """Set every line low and read them back; tried twice.

        Raises:
            LaserOffNotConfirmedError: they do not read low.
        """
        came = ""
        for _ in range(2):
            try:
                self._write(0)
                mask = self._read()
            except Exception as error:  # a foreign driver's, of any kind: the guardian must not end on it
                came = str(error)
            else:
                if mask == 0:
                    return
                came = f"lines read back as {mask:b} (binary)"
        raise LaserOffNotConfirmedError(
            f"the lasers at {self._lines} may be on: {came}; treat the beams as on, cut the lasers' supply"
        )

    def state(self) -> tuple[int, bool | None]:
        """Mask of the lines that are high; the board has no interlock.

        Raises:
            RigNotReadyError: it does not answer.
        """
        with self._asked("read the lines"):
            return self._read(), None

    def _write(self, mask: int) -> None:
        levels = [bool(mask >> line & 1) for line in range(self._count)]
        # One line takes one level, several take a list.
        self._task.write(levels if self._count > 1 else levels[0], auto_start=True)

    def _read(self) -> int:
        came = self._task.read()
        levels = came if isinstance(came, list) else [came]
        return sum(1 << line for line, high in enumerate(levels) if high)

    @contextmanager
    def _asked(self, what: str) -> Iterator[None]:
        """Turn any error of the board's package into a `RigNotReadyError`."""
        try:
            yield
        except Exception as error:
            raise RigNotReadyError(
                f"lasers at {self._lines}: expected the board to {what}, got: {error};"
                " check that NI-DAQmx is installed, the board is plugged in, and its lines are named right"
            ) from None
