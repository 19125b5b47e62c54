"""Bench of separate devices (camera, lasers, target), each opened by its own driver."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.devices.drivers import CameraDriver, DriverUnusableError, TargetDriver, load_driver
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.devices.guarded_line import GuardedLine
from workbench.devices.protocols import Bench, Camera, Target
from workbench.model.errors import BadInputError
from workbench.model.problems import SchemaProblem
from workbench.model.rig import Rig
from workbench.model.yamlfile import schema_problems


@dataclass(frozen=True)
class DeviceKind:
    """Kind of device."""

    group: str
    """Entry-point group of the drivers."""
    default: str
    """Driver if the rig file names none."""


KINDS = {
    "camera": DeviceKind("workbench.cameras", "opencv"),
    "lasers": DeviceKind("workbench.lasers", "serial"),
    "target": DeviceKind("workbench.targets", "by_hand"),
}
"""Kinds of devices by their key in the block `devices`."""


def open_bench(rig: Rig) -> Bench:
    """Open the rig's devices, the lasers first, so that they are off if another device fails.

    Raises:
        BadInputError: a driver is not installed, or its block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: a device fails.
    """
    refuse_problems(rig, tuple(KINDS))
    lasers = open_lasers(rig)
    try:
        return Bench(camera=open_camera(rig, lasers.beat), lasers=lasers, target=open_target(rig))
    except BaseException:
        lasers.close()
        raise


def open_camera(rig: Rig, beat: Callable[[], None] = lambda: None) -> Camera:
    """Open only the camera.

    Args:
        rig: rig.
        beat: see `CameraDriver.open`; without effect where no laser is on.

    Raises:
        BadInputError: the driver is not installed, or its block is wrong.
        RigNotReadyError: see `CameraDriver.open`.
    """
    refuse_problems(rig, ("camera",))
    camera: CameraDriver
    camera, settings = _driver(rig, "camera")
    return camera.open(settings, rig, beat)


def open_target(rig: Rig) -> Target:
    """Open only the target; raises errors as `open_camera`."""
    refuse_problems(rig, ("target",))
    target: TargetDriver
    target, settings = _driver(rig, "target")
    return target.open(settings, rig)


def open_lasers(rig: Rig) -> GuardedLaserBank:
    """Open only the lasers, all off; the blocks of other devices are not read.

    Raises:
        BadInputError: the driver is not installed, or its block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: see `GuardedLaserBank`.
    """
    refuse_problems(rig, ("lasers",))
    line_type: type[GuardedLine]
    line_type, settings = _driver(rig, "lasers")
    return GuardedLaserBank(line_type, settings, rig.laser_ids, lines=rig.laser_lines)


def refuse_problems(rig: Rig, kinds: Sequence[str]) -> None:
    """Check the blocks of these kinds of devices.

    Raises:
        BadInputError: a block is wrong; one line for each problem.
    """
    found = [one.message for kind in kinds for one in block_problems(kind, _block(rig, kind), rig)]
    if found:
        raise BadInputError("\n".join(f"rig {rig.rig}: {one}" for one in found))


def block_problems(kind: str, block: Mapping[str, Any], rig: Rig | None) -> Iterator[SchemaProblem]:
    """Problems of one device's block.

    Args:
        kind: key in `KINDS`.
        block: block of the rig file.
        rig: valid rig, the context of the block's validators; None if the rig is not valid.
    """
    name = block.get("driver") or KINDS[kind].default
    if not isinstance(name, str):
        return  # the rig's own schema reports this mistake
    place = ("devices", kind)
    try:
        driver = load_driver(KINDS[kind].group, name)
    except DriverUnusableError as error:
        yield SchemaProblem((*place, "driver"), str(error))
    else:
        yield from schema_problems(driver.settings_type, block, place, rig)


def _block(rig: Rig, kind: str) -> dict[str, Any]:
    block: dict[str, Any] = {}
    if rig.devices is not None:
        block = getattr(rig.devices, kind).model_dump(exclude_unset=True)
    return block


def _driver(rig: Rig, kind: str) -> tuple[Any, Any]:
    """Driver and settings of a valid block."""
    block = _block(rig, kind)
    driver = load_driver(KINDS[kind].group, block.get("driver") or KINDS[kind].default)
    return driver, driver.settings_type.model_validate(block, context=rig)
