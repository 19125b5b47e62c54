"""Look-up of device drivers by entry point, in this and other installed packages."""

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
    """Protocol of a class named by an entry point in the group `workbench.cameras`."""

    settings_type: ClassVar[Any]
    """Block `devices: camera:` of the rig file, a `DeviceBlock`."""

    @classmethod
    def open(cls, settings: Any, rig: Rig, beat: Callable[[], None]) -> Camera:
        """Open the camera.

        Args:
            settings: validated block, an instance of `settings_type`.
            rig: rig; `rig.camera` is the required format of frames.
            beat: must be called at least every 0.1 s while waiting for a frame, in the same thread. Without
                beats the guardian assumes that the workbench hangs and switches the lasers off.

        Raises:
            RigNotReadyError: the camera is missing, does not answer, or contradicts the rig file.
        """


class TargetDriver(Protocol):
    """Protocol of a class named by an entry point in the group `workbench.targets`."""

    settings_type: ClassVar[Any]
    """Block `devices: target:` of the rig file, a `DeviceBlock`."""

    @classmethod
    def open(cls, settings: Any, rig: Rig) -> Target:
        """Open the device that places the target.

        Raises:
            RigNotReadyError: the device is missing or does not answer.
        """


@dataclass(frozen=True)
class BenchDriver:
    """Driver of a bench whose devices are opened together (entry-point group `workbench.benches`)."""

    open: Callable[[Rig, Path], Bench]
    """Function that opens the bench for a rig and a session folder."""
    blocks: Mapping[str, type[FileModel]]
    """Models of the rig file's blocks that the driver reads, by key."""
    virtual: bool
    """Whether the lasers are simulated and end with the process that uses them."""


class DriverUnusableError(Exception):
    """A driver is not installed or cannot be used."""


BENCHES = "workbench.benches"
PROTOCOLS: Mapping[str, type] = {
    "workbench.cameras": CameraDriver,
    "workbench.lasers": GuardedLine,
    "workbench.targets": TargetDriver,
}
"""Protocols of device drivers by entry-point group."""


def installed(group: str) -> list[str]:
    """Names of the installed drivers of an entry-point group, sorted."""
    return sorted(entry_points(group=group).names)


def load_driver(group: str, name: str) -> Any:
    """Load the driver with the entry point `name` in a group.

    Raises:
        DriverUnusableError: the driver is not installed, is installed by two distributions, cannot be
            imported, or does not implement the protocol of the group.
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
        known = ", ".join(installed(group)) or "none"
        raise DriverUnusableError(
            f"expected an installed driver of the group {group} ({known}), got {name}; install the package"
            " that provides it"
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
    except (Exception, SystemExit) as error:  # code of other packages may raise anything
        raise DriverUnusableError(
            f"driver {point.name}: expected {point.value} to be importable, got {type(error).__name__}:"
            f" {error}; reinstall its package with the libraries that it needs"
        ) from None


def _contradiction(group: str, driver: Any) -> str | None:
    """Description of how a driver contradicts the protocol of its group; None if it does not."""
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
