"""A camera that adjusts itself, on real streams in colour: found by its background."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest

from tests.support.mjpeg import Picture, Stream
from workbench.devices.opencv_camera import OpenCvBlock, OpenCvCamera
from workbench.devices.protocols import LaserState
from workbench.model.rig import CameraSpec, Rig, exactly
from workbench.procedure.capture.automatic import darkening

WIDTH, HEIGHT = 160, 120
FORMAT = CameraSpec(
    width_px=WIDTH, height_px=HEIGHT, f_px=exactly(200.0), cx_px=exactly(79.5), cy_px=exactly(59.5)
)
LASER = {"id": "L1", "axis": "u", "x_mm": {"value": 60.0, "sd": 0}, "y_mm": {"value": 0.0, "sd": 0}}
RIG = Rig.model_validate({"format": 1, "rig": "red", "camera": FORMAT, "lasers": [LASER]})


class Scene:
    """A wall with a red spot, seen by a camera whose gain follows the brightest pixel by `automatic`."""

    ids: tuple[str, ...] = ("L1",)
    identity = "fake"

    def __init__(self, automatic: float, flicker: float, seed: int) -> None:
        self.automatic, self.flicker = automatic, flicker
        self.rng = np.random.default_rng(seed)
        self.is_lit, self.gain = False, 1.0

    def picture(self) -> Picture:
        brightest = 200.0 if self.is_lit else 80.0
        self.gain += 0.5 * ((80.0 / brightest) ** self.automatic - self.gain)
        wall = 80.0 * (1 + self.flicker * self.rng.normal())
        image = np.full((HEIGHT, WIDTH, 3), wall) + self.rng.normal(0, 2, (HEIGHT, WIDTH, 3))
        if self.is_lit:
            image[57:63, 100:106, 2] += 120.0
        return np.clip(image * self.gain, 0, 255).astype(np.uint8)

    @contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        self.is_lit = bool(ids)
        yield
        self.is_lit = False

    def all_off(self) -> None:
        self.is_lit = False

    def beat(self) -> None:
        pass

    def state(self) -> LaserState:
        return LaserState((), None)

    def close(self) -> None:
        pass


def measured(automatic: float, flicker: float, seed: int) -> float | None:
    scene = Scene(automatic, flicker, seed)
    stream = Stream(scene.picture)
    camera = OpenCvCamera(OpenCvBlock(source=stream.url, latency_frames=6), FORMAT)
    try:
        return darkening(scene, camera, RIG)
    finally:
        camera.close()
        stream.close()


@pytest.mark.parametrize("automatic", [0.05, 0.5, 1.0])
def test_a_camera_that_adjusts_itself_is_found(automatic: float) -> None:
    share = measured(automatic, 0.0, 1)
    assert share == pytest.approx(1 - 0.4**automatic, rel=0.1)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("flicker", [0.0, 0.02])
def test_fixed_settings_are_not_taken_for_automatic_ones(seed: int, flicker: float) -> None:
    assert measured(0.0, flicker, seed) is None
