"""Drivers of devices, found by entry point: each is one module, of whatever package is installed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, ClassVar, Protocol

from workbench.devices.protocols import Bench, Camera, Target
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel


class CameraDriver(Protocol):
    """A class named by an entry point in the group `workbench.cameras`."""

    settings_type: ClassVar[Any]
    """The block `devices: camera:` of the rig file, a `DeviceBlock`."""

    @classmethod
    def open(cls, settings: Any, rig: Rig, beat: Callable[[], None]) -> Camera:
        """Open the camera.

        Args:
            settings: the validated block, an instance of `settings_type`.
            rig: the rig; `rig.camera` is the format that frames must have.
            beat: to be called at least every 0.1 s while a frame is waited for, in the thread that asks for
                it; without beats the guardian takes the workbench for hung and switches the lasers off.

        Raises:
            RigNotReadyError: the camera is missing, silent, or contradicts the rig file.
        """


class TargetDriver(Protocol):
    """A class named by an entry point in the group `workbench.targets`."""

    settings_type: ClassVar[Any]
    """The block `devices: target:` of the rig file, a `DeviceBlock`."""

    @classmethod
    def open(cls, settings: Any, rig: Rig) -> Target:
        """Open what places the target.

        Raises:
            RigNotReadyError: it is missing or does not answer.
        """


@dataclass(frozen=True)
class BenchDriver:
    """What an entry point in the group `workbench.benches` names: devices that cannot be opened apart."""

    open: Callable[[Rig, Path], Bench]
    """From the rig and the session's folder to the opened bench."""
    blocks: Mapping[str, type[FileModel]]
    """Blocks of the rig file that it reads, by their key."""
    virtual: bool
    """Whether its lasers are simulated, and end with the process that switches them on."""


class DriverUnusableError(Exception):
    """No such driver is installed, or the installed one cannot be loaded."""


def installed(group: str) -> list[str]:
    """Names of the installed drivers of an entry-point group, sorted."""
    return sorted(entry_points(group=group).names)


def load_driver(group: str, name: str) -> Any:
    """What the entry point `name` of a group names.

    Raises:
        DriverUnusableError: it is not installed, or cannot be imported.
    """
    known = installed(group)
    if name not in known:
        raise DriverUnusableError(
            f"expected an installed driver of the group {group} ({', '.join(known) or 'there is none'}), got"
            f" {name}; install the package that has it"
        )
    try:
        return entry_points(group=group)[name].load()
    except (ImportError, AttributeError) as error:
        raise DriverUnusableError(
            f"expected a driver that can be imported, got {error}; install the package of {name} anew"
        ) from None
