"""Target driver `by_hand`: the operator places the target when a prompt requests it."""

from __future__ import annotations

from typing import ClassVar

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import RigNotReadyError
from workbench.model.rig import Rig
from workbench.model.target import Placement


class ByHandBlock(DeviceBlock):
    """Block `devices: target:` of the rig file, without settings."""


class PlacedByHand:
    """Target that the operator has already placed, with its standoff read; see `protocols.Target`."""

    settings_type: ClassVar = ByHandBlock

    @classmethod
    def open(cls, settings: ByHandBlock, rig: Rig) -> PlacedByHand:
        """Return the driver; there is no device to open."""
        return cls()

    def place(self, placement: Placement) -> Placement:
        """Placement as the operator confirmed it.

        Raises:
            RigNotReadyError: a scanning head is to be turned.
        """
        if placement.head_deg is not None:
            raise RigNotReadyError(
                "target: expected a driver that turns the scanning head (docs/scanning.md), got by_hand"
            )
        return placement
