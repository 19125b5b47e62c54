"""Devices of the virtual bench, opened together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from workbench.devices.controller_line import ControllerLine, SerialBlock
from workbench.devices.guarded_lasers import LONGEST_LEASE_S, GuardedLaserBank
from workbench.devices.protocols import Bench
from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.controller import Controller
from workbench.emulator.operator import EmulatedOperator
from workbench.emulator.pty import PtyServer
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat
from workbench.emulator.truth import draw_truth, truth_path
from workbench.model.rig import Rig


@dataclass(frozen=True, kw_only=True)
class EmulatedBench(Bench):
    """Virtual bench with parts that tests use: camera, controller behind the port, server of the port."""

    camera: EmulatedCamera
    lasers: GuardedLaserBank
    target: BenchScene
    controller: Controller
    server: PtyServer

    def __enter__(self) -> EmulatedBench:
        return self

    def close(self) -> None:
        """Close camera and lasers, then disconnect the controller's line."""
        try:
            super().close()
        finally:
            self.server.close()


def open_bench(rig: Rig, session_dir: Path) -> EmulatedBench:
    """Open the virtual bench of `rig`; its truth is written to a file beside `session_dir`.

    Raises:
        BadInputError: the rig's `emulator:` block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: the emulated controller has a fault.
    """
    spec = emulator_spec(rig)
    truth = draw_truth(rig, spec)
    scene = BenchScene(rig, spec, truth, truth_path(session_dir))
    sensor = ImageSensor(spec, ImageFormat(rig.camera.width_px, rig.camera.height_px), rig.camera.bits)
    beams = {group[0].id: tuple(laser.id for laser in group) for group in rig.emitters}
    controller = Controller(tuple(beams), spec.controller)
    camera = EmulatedCamera(
        spec, scene, sensor, lambda: tuple(name for line in controller.lit() for name in beams[line])
    )
    server = PtyServer(controller.receive)
    try:
        # Computing a frame may take longer than the usual time between beats.
        lasers = GuardedLaserBank(
            ControllerLine,
            SerialBlock(port=server.port),
            rig.laser_ids,
            hang_s=LONGEST_LEASE_S,
            virtual=True,
            lines=rig.laser_lines,
        )
    except BaseException:
        server.close()
        raise
    return EmulatedBench(
        camera=camera,
        lasers=lasers,
        target=scene,
        operator=EmulatedOperator() if spec.answers else None,
        mark=camera.mark,
        virtual=True,
        clock=camera.clock,
        rests=not (spec.warm_up.f_relative or spec.drift.u_px_per_frame or spec.drift.v_px_per_frame),
        controller=controller,
        server=server,
    )
