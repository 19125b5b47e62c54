"""Base class of a device's block in the rig file. It imports little, because the guardian needs it."""

from __future__ import annotations

from workbench.model.yamlfile import FileModel


class DeviceBlock(FileModel):
    """Block `devices: <kind>:` of one device; each driver derives its own block and adds its settings."""

    driver: str | None = None
    """Name of an entry point in the group of the device's kind; None: the default driver of that kind."""
