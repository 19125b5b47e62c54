"""Drivers of devices, found by entry point: each is one module, of whatever package is installed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, ClassVar, Protocol

from workbench.devices.guarded_line import GuardedLine
from workbench.devices.protocols import Bench, Camera, Target
from workbench.model.device_block import DeviceBlock
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
    """No such driver is installed, or the installed one cannot be used."""


BENCHES = "workbench.benches"
PROTOCOLS: Mapping[str, type] = {
    "workbench.cameras": CameraDriver,
    "workbench.lasers": GuardedLine,
    "workbench.targets": TargetDriver,
}
"""What a driver of a device has to be, by its entry-point group."""


def installed(group: str) -> list[str]:
    """Names of the installed drivers of an entry-point group, sorted."""
    return sorted(entry_points(group=group).names)


def load_driver(group: str, name: str) -> Any:
    """What the entry point `name` of a group names.

    Raises:
        DriverUnusableError: it is not installed, two distributions have one of that name, it cannot be
            imported, or it is no driver of that group.
    """
    driver = _loaded(_only_point(group, name))
    problem = _contradiction(group, driver)
    if problem is not None:
        raise DriverUnusableError(
            f"driver {name}: {problem}; repair or update the package that has this entry point"
        )
    return driver


def _only_point(group: str, name: str) -> EntryPoint:
    points = tuple(entry_points(group=group, name=name))
    if not points:
        known = ", ".join(installed(group)) or "there is none"
        raise DriverUnusableError(
            f"expected an installed driver of the group {group} ({known}), got {name}; install the package"
            " that has it"
        )
    if len(points) > 1:
        named = " and ".join(f"{_distribution(point)} ({point.value})" for point in points)
        raise DriverUnusableError(
            f"expected one driver {name} of the group {group}, got those of {named}; uninstall all but one"
        )
    return points[0]


def _distribution(point: EntryPoint) -> str:
    return "an unnamed distribution" if point.dist is None else point.dist.name


def _loaded(point: EntryPoint) -> Any:
    try:
        return point.load()
    except (Exception, SystemExit) as error:  # a foreign module's, of any kind, such as a missing library
        raise DriverUnusableError(
            f"driver {point.name}: expected {point.value} to be importable, got {type(error).__name__}:"
            f" {error}; install its package anew, with the libraries that it needs"
        ) from None


def _contradiction(group: str, driver: Any) -> str | None:
    """Where a driver contradicts its group's protocol; None: nowhere."""
    if group == BENCHES:
        return None if isinstance(driver, BenchDriver) else f"expected a BenchDriver, got {driver!r}"
    protocol = PROTOCOLS[group]
    if not isinstance(driver, type):
        return f"expected a class with the members of {protocol.__name__}, got {driver!r}"
    members = {**protocol.__annotations__, **vars(protocol)}
    missing = [one for one in members if not one.startswith("_") and not hasattr(driver, one)]
    if missing:
        return f"expected a class with the members of {protocol.__name__}, {', '.join(missing)} missing"
    block: Any = getattr(driver, "settings_type", None)
    if not (isinstance(block, type) and issubclass(block, DeviceBlock)):
        return f"expected its settings_type to be a DeviceBlock, got {block!r}"
    return None
