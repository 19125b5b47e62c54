"""The target driver `by_hand`: the operator places the target when a prompt asks for it."""

from __future__ import annotations

from typing import ClassVar

from workbench.model.device_block import DeviceBlock
from workbench.model.rig import Rig
from workbench.model.target import Placement


class ByHandBlock(DeviceBlock):
    """The block `devices: target:` of the rig file: it has no settings."""


class PlacedByHand:
    """See `protocols.Target`. The operator has placed the target, and read the ruler, before it is asked."""

    settings_type: ClassVar = ByHandBlock

    @classmethod
    def open(cls, settings: ByHandBlock, rig: Rig) -> PlacedByHand:
        """There is nothing to open."""
        return cls()

    def place(self, placement: Placement) -> Placement:
        """The placement as the operator confirmed it."""
        return placement
