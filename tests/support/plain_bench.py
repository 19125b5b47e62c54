"""The virtual bench with lasers that no guardian watches: no process beside the test's own."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from workbench.devices.protocols import Bench, LaserState
from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat
from workbench.emulator.truth import draw_truth
from workbench.model.errors import LeaseEndedError, RigNotReadyError
from workbench.model.rig import Rig


@dataclass
class PlainLasers:
    """Lasers that are on inside `lit` until the lease ends."""

    ids: tuple[str, ...]
    interlock_closed: bool
    identity: str = "plain lasers"
    ends_s: float = 0.0
    """End of the lease on the clock of `time.monotonic`."""
    _lit: tuple[str, ...] = ()

    @property
    def on(self) -> tuple[str, ...]:
        return self._lit if time.monotonic() < self.ends_s else ()

    @contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        if not self.interlock_closed:
            raise RigNotReadyError("interlock open")
        self._lit, self.ends_s = tuple(ids), time.monotonic() + for_s
        try:
            yield
        finally:
            self._lit = ()
        if time.monotonic() > self.ends_s:
            raise LeaseEndedError("the lease ended before the end of the block")

    def beat(self) -> None:
        pass

    def all_off(self) -> None:
        self._lit = ()

    def state(self) -> LaserState:
        return LaserState(self.on, self.interlock_closed)

    def close(self) -> None:
        self._lit = ()


def plain_bench(rig: Rig, folder: Path) -> Bench:
    """The bench of `rig` without an operator; its truth goes to `folder`/truth.yaml."""
    spec = emulator_spec(rig)
    scene = BenchScene(rig, spec, draw_truth(rig, spec), folder / "truth.yaml")
    sensor = ImageSensor(spec, ImageFormat(rig.camera.width_px, rig.camera.height_px), rig.camera.bits)
    lasers = PlainLasers(rig.laser_ids, spec.controller.interlock_closed)
    camera = EmulatedCamera(spec, scene, sensor, lambda: lasers.on)
    return Bench(camera, lasers, scene, camera.mark, virtual=True, clock=camera.clock, rests=True)
