"""Laser driver `nidaqmx`: lasers on the lines of a digital output board, through NI-DAQmx.

The board has no leases: a level stays until another one is written. Only the guardian, with its own clock,
ends an emission (docs/laser-controller.md).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.number_text import counted

PACKAGE = "nidaqmx"


class DigitalOutputBlock(DeviceBlock):
    """Block `devices: lasers:` of the rig file."""

    port: str
    """Lines of the board, such as `Dev1/port0/line0:3`."""


class DigitalOutputLine:
    """Laser driver, see `guarded_line.GuardedLine`; laser 1 is the first line."""

    settings_type: ClassVar = DigitalOutputBlock
    has_leases: ClassVar[bool] = False

    def __init__(self, settings: DigitalOutputBlock, lasers: int, alarm: Callable[[], bool]) -> None:
        """Reserve the board's lines and set them low.

        Raises:
            BadInputError: there are fewer lines than lasers.
            RigNotReadyError: the package or its driver is missing, or there are no such lines.
        """
        self._lines = lines = settings.port
        try:
            package = importlib.import_module(PACKAGE)
            constants = importlib.import_module(f"{PACKAGE}.constants")
        except ImportError as error:
            raise RigNotReadyError(
                f"lasers at {lines}: expected the package {PACKAGE}, got: {error};"
                f" install it with `pip install 'laser-range-workbench[{PACKAGE}]'`, and NI's driver"
            ) from None
        with self._asked("reserve the lines"):
            self._task: Any = package.Task()
            self._task.do_channels.add_do_chan(lines, line_grouping=constants.LineGrouping.CHAN_PER_LINE)
            self._count = int(self._task.number_of_channels)
            self._write(0)
        if self._count < lasers:
            raise BadInputError(
                f"lasers at {lines}: expected a line for each of the rig's {lasers} lasers, got"
                f" {self._count}; name {lasers} lines in the rig file (devices: lasers: port)"
            )

    def identify(self, boot_s: float) -> str:
        """Product and name of the board, which needs no time to boot.

        Raises:
            RigNotReadyError: the board does not answer.
        """
        with self._asked("return its name"):
            boards = [f"{device.product_type} {device.name}" for device in self._task.devices]
        return f"{', '.join(boards)}, {counted(self._count, 'line')}"

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off; the lease is the guardian's.

        Raises:
            RigNotReadyError: the board refuses.
        """
        with self._asked("set the lines"):
            self._write(mask)

    def all_off(self) -> None:
        """Set every line low and read the lines back; tried twice.

        Raises:
            LaserOffNotConfirmedError: a line does not read low.
        """
        cause = ""
        for _ in range(2):
            try:
                self._write(0)
                mask = self._read()
            except Exception as error:  # the vendor's package may raise anything; the guardian must not end
                cause = str(error)
            else:
                if mask == 0:
                    return
                cause = f"the lines read {mask:b} (binary), expected 0"
        raise LaserOffNotConfirmedError(
            f"the lasers at {self._lines} may be on: {cause}; treat the beams as on; cut the lasers' power"
        )

    def state(self) -> tuple[int, bool | None]:
        """Mask of the lines that are high; the board has no interlock.

        Raises:
            RigNotReadyError: the board does not answer.
        """
        with self._asked("read the lines"):
            return self._read(), None

    def _write(self, mask: int) -> None:
        levels = [bool(mask >> line & 1) for line in range(self._count)]
        # NI-DAQmx expects a single value for one line, a list for several.
        self._task.write(levels if self._count > 1 else levels[0], auto_start=True)

    def _read(self) -> int:
        read = self._task.read()
        levels = read if isinstance(read, list) else [read]
        return sum(1 << line for line, high in enumerate(levels) if high)

    @contextmanager
    def _asked(self, what: str) -> Iterator[None]:
        """Turn any error of the board's package into a `RigNotReadyError`."""
        try:
            yield
        except Exception as error:
            raise RigNotReadyError(
                f"lasers at {self._lines}: expected the board to {what}, got: {error};"
                " check that NI-DAQmx is installed, the board is connected, and the names of its lines"
            ) from None
