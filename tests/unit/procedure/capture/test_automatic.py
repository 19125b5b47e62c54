"""A camera that adjusts itself, in a lit and in a dark room; a lamp that fades is none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.fake_lasers import FakeLasers
from tests.support.mjpeg import Picture, Stream
from workbench.devices.opencv_camera import OpenCvBlock, OpenCvCamera
from workbench.devices.protocols import Frame
from workbench.model.prior import exactly
from workbench.model.rig import CameraSpec, Rig
from workbench.procedure.capture.automatic import AutomaticControl, find_automatic_control

WIDTH, HEIGHT = 160, 120
FORMAT = CameraSpec(
    width_px=WIDTH, height_px=HEIGHT, f_px=exactly(200.0), cx_px=exactly(79.5), cy_px=exactly(59.5)
)
LASER = {"id": "L1", "axis": "u", "x_mm": {"value": 60.0, "sd": 0}, "y_mm": {"value": 0.0, "sd": 0}}
RIG = Rig.model_validate({"format": 1, "rig": "red", "camera": FORMAT, "lasers": [LASER]})


LATENCY = 6
"""Frames under way in the stream."""


class Scene(FakeLasers):
    """A wall with a red spot, seen by a camera whose gain follows the brightest pixel by `automatic`."""

    def __init__(
        self,
        automatic: float = 0.0,
        wall: float = 80.0,
        flicker: float = 0.0,
        fade: float = 0.0,
        seed: int = 1,
    ) -> None:
        self.automatic, self.flicker, self.fade = automatic, flicker, fade
        self.rng = np.random.default_rng(seed)
        self.gain, self.wall = 1.0, wall

    def picture(self) -> Picture:
        brightest = max(self.wall + 120.0 * self.is_lit, 20.0)
        self.gain += 0.5 * ((80.0 / brightest) ** self.automatic - self.gain)
        self.wall *= 1 - self.fade
        wall = self.wall * (1 + self.flicker * self.rng.normal())
        image = np.full((HEIGHT, WIDTH, 3), wall) + self.rng.normal(0, 2, (HEIGHT, WIDTH, 3))
        if self.is_lit:
            image[57:63, 100:106, 2] += 120.0
        return np.clip(image * self.gain, 0, 255).astype(np.uint8)


class Direct:
    """Camera that delivers the scene's red channel at once."""

    identity = "direct"
    discard_frames = 0
    width_px, height_px = WIDTH, HEIGHT

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def read(self) -> Frame:
        return Frame(self.scene.picture()[..., 2], 0)

    def grab(self) -> Frame:
        return self.read()

    def grab_ambient(self) -> Frame:
        return self.read()

    def close(self) -> None:
        pass


def streamed(scene: Scene) -> AutomaticControl:
    """Signs by OpenCV's camera on a stream in colour."""
    stream = Stream(scene.picture, latency=LATENCY)
    camera = OpenCvCamera(OpenCvBlock(source=stream.url, latency_frames=LATENCY), FORMAT)
    try:
        return find_automatic_control(scene, camera, RIG)
    finally:
        camera.close()
        stream.close()


def direct(scene: Scene) -> AutomaticControl:
    return find_automatic_control(scene, Direct(scene), RIG)


@pytest.mark.parametrize("automatic", [0.05, 0.5, 1.0])
@pytest.mark.parametrize("flicker", [0.0, 0.002])
def test_a_lit_room_darkens_if_the_camera_adjusts_itself(automatic: float, flicker: float) -> None:
    found = direct(Scene(automatic, flicker=flicker))
    assert found.darkening == pytest.approx(1 - 0.4**automatic, rel=0.1)


@pytest.mark.parametrize("automatic", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("wall", [0.0, 1.0])
def test_in_a_dark_room_the_spot_dims(automatic: float, wall: float) -> None:
    found = direct(Scene(automatic, wall=wall))
    assert found.dimming is not None
    # From the first lit frame, at half the way from the gain in the dark, or clipped, to the settled one.
    dark, lit = (80.0 / 20.0) ** automatic, (80.0 / (120.0 + wall)) ** automatic
    first = min((dark + lit) / 2, 255 / 120)
    assert found.dimming == pytest.approx(1 - lit / first, abs=0.05)


@pytest.mark.parametrize("fade", [0.001, 0.003, 0.01, -0.003])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_lamp_that_fades_is_no_automatic_control(fade: float, seed: int) -> None:
    """In the 13 frames between two switchings the lamp loses up to 12 %."""
    assert direct(Scene(fade=fade, flicker=0.002, seed=seed)) == AutomaticControl(None, None)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("wall", "flicker"), [(80.0, 0.0), (80.0, 0.02), (1.0, 0.0), (0.0, 0.0)])
def test_fixed_settings_are_not_taken_for_automatic_ones(seed: int, wall: float, flicker: float) -> None:
    assert direct(Scene(wall=wall, flicker=flicker, seed=seed)) == AutomaticControl(None, None)


def test_signs_are_seen_on_a_stream() -> None:
    lit, dark, fading = (streamed(s) for s in (Scene(0.5), Scene(0.5, wall=0.0), Scene(fade=0.003)))
    assert lit.darkening == pytest.approx(1 - 0.4**0.5, rel=0.1)
    assert dark.dimming is not None
    assert dark.dimming > 0.2
    assert fading == AutomaticControl(None, None)
