"""The driver `opencv+serial`: a camera that OpenCV opens, lasers on a controller, a target put by hand."""

from __future__ import annotations

from pathlib import Path

from workbench.devices.opencv_camera import OpenCvCamera
from workbench.devices.protocols import Bench
from workbench.devices.serial_lasers import SerialLaserBank
from workbench.model.errors import BadInputError
from workbench.model.rig import DeviceSpec, Rig
from workbench.model.target import Placement

BLOCKS = {"devices": DeviceSpec}
"""Of a rig file, which it cannot do without; see `registry.blocks_of`."""


class PlacedByHand:
    """The operator was asked to put the target there, and told where it stands."""

    def place(self, placement: Placement) -> Placement:
        """The placement as it was told."""
        return placement


def devices_of(rig: Rig) -> DeviceSpec:
    """What the rig file says of camera and controller.

    Raises:
        BadInputError: nothing.
    """
    if rig.devices is None:
        raise BadInputError(
            f"rig {rig.rig}: devices: expected the camera's source and the laser controller's port, got none;"
            " docs/rig-format.md shows them"
        )
    return rig.devices


def open_lasers(rig: Rig) -> SerialLaserBank:
    """The lasers alone, all off.

    Raises:
        BadInputError: the rig file has no port.
        RigNotReadyError, LaserOffNotConfirmedError: see `SerialLaserBank`.
    """
    device = devices_of(rig).lasers
    return SerialLaserBank(device.port, rig.laser_ids, device.baud, driver=device.driver)


def open_bench(rig: Rig, session_dir: Path) -> Bench:
    """The rig's bench. The lasers come first: whatever else fails, they are off.

    Raises:
        BadInputError: the rig file does not say where its devices are.
        RigNotReadyError, LaserOffNotConfirmedError: a device does not answer as it should.
    """
    devices = devices_of(rig)
    lasers = open_lasers(rig)
    try:
        camera = OpenCvCamera(devices.camera, rig.camera, lasers.beat)
    except BaseException:
        lasers.close()
        raise
    return Bench(camera=camera, lasers=lasers, target=PlacedByHand())
