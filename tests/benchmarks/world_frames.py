"""Frames of the virtual bench in a world: 640 x 480 pixels, four spots, a pair of frames at each new pose."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat
from workbench.emulator.truth import draw_truth
from workbench.model.rig import load_rig
from workbench.model.target import Placement, WorldTarget
from workbench.model.world import Pose, load_world

ROOT = Path(__file__).parents[2]
POSES = 60
STARTS = {
    "obstacles": ("cube at 2 m", Pose(x_mm=3900, y_mm=0)),
    "obstacles, edge": ("cube and wall", Pose(x_mm=4900, y_mm=100)),
    "office": ("wall behind poles", Pose(x_mm=300, y_mm=1200)),
    "office, leg": ("leg and wall", Pose(x_mm=1900, y_mm=1030)),
}
EXPOSURE_S = 1e-4


def lines() -> Iterator[str]:
    """Frames a second of a core, with all lasers on and off in turn."""
    yield "frames a second of a core in a world, 640 x 480, four spots, a pair at each pose"
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    spec = emulator_spec(rig)
    lit = list[str]()
    with tempfile.TemporaryDirectory() as folder:
        scene = BenchScene(rig, spec, draw_truth(rig, spec), Path(folder) / "truth.yaml")
        sensor = ImageSensor(spec, ImageFormat(rig.camera.width_px, rig.camera.height_px), rig.camera.bits)
        camera = EmulatedCamera(spec, scene, sensor, lambda: tuple(lit))
        camera.exposure_s = EXPOSURE_S
        for name, (text, start) in STARTS.items():
            world = load_world(ROOT / f"procedures/worlds/{name.split(',')[0]}.yaml")
            began = 0.0
            for n in range(-2, POSES):  # two poses fill the tables
                if n == 0:
                    began = time.process_time()
                target = WorldTarget(world=world, pose=start.ahead(10.0 * n), speed_mm_s=300.0)
                scene.place(Placement(key="w", standoff_mm=1000.0, target=target))
                camera.mark(f"w/{n}")
                for lasers in (rig.laser_ids, ()):
                    lit[:] = lasers
                    camera.grab()
            yield f"{name:16s} {text:18s} {2 * POSES / (time.process_time() - began):6.0f}"
