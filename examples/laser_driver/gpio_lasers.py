"""The laser driver `gpio_files`: lasers on GPIO lines that are files, as /sys/class/gpio/gpio17/value.

A whole laser driver, in one module: the block of the rig file, and the line that the guardian holds. See
`workbench.devices.guarded_line.GuardedLine` for what each method has to do.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError


class GpioFilesBlock(DeviceBlock):
    """The block `devices: lasers:` of the rig file."""

    files: Annotated[tuple[str, ...], Field(min_length=1)]
    """One for each laser, in the order of the rig file: 1 is on, 0 is off."""
    active_low: bool = False
    """Whether 0 is on and 1 is off."""


class GpioFilesLine:
    """Lasers that are switched by writing to files."""

    settings_type: ClassVar = GpioFilesBlock
    has_leases: ClassVar[bool] = False
    """A GPIO line keeps what was written; the guardian's clock ends an emission."""

    def __init__(self, settings: GpioFilesBlock, lasers: int, alarm: Callable[[], bool]) -> None:
        """Count the files; `alarm` is not used, because this driver never waits.

        Raises:
            BadInputError: fewer files than lasers.
        """
        self._files = [Path(file) for file in settings.files]
        self._on, self._off = ("0", "1") if settings.active_low else ("1", "0")
        if len(self._files) < lasers:
            raise BadInputError(
                f"devices.lasers.files: expected one for each of {lasers} lasers, got {len(self._files)}"
            )

    def identify(self, boot_s: float) -> str:
        """Number of lines; a GPIO line needs no time to boot, and is switched off before anything else."""
        self.all_off()
        return f"{len(self._files)} GPIO lines"

    def light(self, mask: int, lease_ms: int) -> None:
        """Write every line; the lease is the guardian's."""
        for bit, file in enumerate(self._files):
            file.write_text(self._on if mask >> bit & 1 else self._off)

    def all_off(self) -> None:
        """Write every line, even where another one fails, and read all back.

        Raises:
            LaserOffNotConfirmedError: a line is missing, or does not read as off.
        """
        missing = [file for file in self._files if not file.exists()]
        for file in self._files:
            if file not in missing:
                with suppress(OSError):
                    file.write_text(self._off)
        if missing:  # only now: the lines that are there are off
            raise LaserOffNotConfirmedError(
                f"GPIO line {missing[0]}: expected this file, the line may be on: export it or cut the supply"
            )
        mask, _ = self.state()
        if mask:
            raise LaserOffNotConfirmedError(
                f"GPIO lines: expected all off, read {mask:b} (binary): treat the beams as on, cut the supply"
            )

    def state(self) -> tuple[int, bool | None]:
        """Mask of the lines that read as on; nothing is known of an interlock."""
        levels = [file.read_text().strip() for file in self._files]
        return sum(1 << bit for bit, level in enumerate(levels) if level != self._off), None
