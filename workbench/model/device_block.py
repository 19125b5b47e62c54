"""Base of a device's block in the rig file. Light to import: the guardian needs it."""

from __future__ import annotations

from workbench.model.yamlfile import FileModel


class DeviceBlock(FileModel):
    """The block `devices: <kind>:` of one device; each driver derives its own and adds its settings."""

    driver: str | None = None
    """Entry point in the group of the device's kind; None: the default of that kind."""
