"""A bench of separate devices: any camera with any lasers and any target, each opened by its own driver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.devices.drivers import CameraDriver, DriverUnusableError, TargetDriver, load_driver
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.devices.guarded_line import GuardedLine
from workbench.devices.protocols import Bench
from workbench.model.errors import BadInputError
from workbench.model.problems import SchemaProblem
from workbench.model.rig import Rig
from workbench.model.yamlfile import schema_problems


@dataclass(frozen=True)
class Kind:
    """A kind of device."""

    group: str
    """Entry-point group of its drivers."""
    default: str
    """Driver where the rig file names none."""


KINDS = {
    "camera": Kind("workbench.cameras", "opencv"),
    "lasers": Kind("workbench.lasers", "serial"),
    "target": Kind("workbench.targets", "by_hand"),
}
"""Kinds of devices, by their key in the block `devices`."""


def open_bench(rig: Rig) -> Bench:
    """Open the rig's devices. The lasers come first: whatever else fails, they are off.

    Raises:
        BadInputError: a driver is not installed, or its block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: a device does not answer as it should.
    """
    refuse_problems(rig, tuple(KINDS))
    camera: CameraDriver
    target: TargetDriver
    camera, camera_settings = _driver(rig, "camera")
    target, target_settings = _driver(rig, "target")
    lasers = open_lasers(rig)
    try:
        return Bench(
            camera=camera.open(camera_settings, rig, lasers.beat),
            lasers=lasers,
            target=target.open(target_settings, rig),
        )
    except BaseException:
        lasers.close()
        raise


def open_lasers(rig: Rig) -> GuardedLaserBank:
    """Open the lasers alone, all off; the other devices' blocks are not read.

    Raises:
        BadInputError: the driver is not installed, or its block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: see `GuardedLaserBank`.
    """
    refuse_problems(rig, ("lasers",))
    line_type: type[GuardedLine]
    line_type, settings = _driver(rig, "lasers")
    return GuardedLaserBank(line_type, settings, rig.laser_ids)


def refuse_problems(rig: Rig, kinds: Sequence[str]) -> None:
    """Raise where the blocks of these kinds of devices are wrong.

    Raises:
        BadInputError: they are, a line for each problem.
    """
    found = [one.told for kind in kinds for one in block_problems(kind, _block(rig, kind), rig)]
    if found:
        raise BadInputError("\n".join(f"rig {rig.rig}: {one}" for one in found))


def block_problems(kind: str, block: Mapping[str, Any], rig: Rig | None) -> Iterator[SchemaProblem]:
    """What is wrong with one device's block.

    Args:
        kind: a key of `KINDS`.
        block: as it stands in the rig file.
        rig: the whole rig, where that is right: the context of the block's validators.
    """
    name = block.get("driver") or KINDS[kind].default
    if not isinstance(name, str):
        return  # a mistake that the rig's own schema finds
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
    """The driver of a block that is right, and its settings."""
    block = _block(rig, kind)
    driver = load_driver(KINDS[kind].group, block.get("driver") or KINDS[kind].default)
    return driver, driver.settings_type.model_validate(block, context=rig)
