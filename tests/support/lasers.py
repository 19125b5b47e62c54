"""Laser banks behind the real guardian, for tests."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.devices.controller_line import ControllerLine, SerialBlock
from workbench.devices.digital_output import DigitalOutputBlock, DigitalOutputLine
from workbench.devices.guarded_lasers import BOOT_S, GuardedLaserBank


def serial_bank(port: str, ids: Sequence[str], boot_s: float = BOOT_S) -> GuardedLaserBank:
    """Lasers on a controller that speaks docs/laser-controller.md."""
    return GuardedLaserBank(ControllerLine, SerialBlock(port=port), ids, boot_s)


def board_bank(lines: str, ids: Sequence[str]) -> GuardedLaserBank:
    """Lasers on a digital output board."""
    return GuardedLaserBank(DigitalOutputLine, DigitalOutputBlock(port=lines), ids)
