"""The emulated camera: a stream of frames that follow one another, and the driver that grabs from it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.devices.protocols import Frame
from workbench.emulator.keyed import generator
from workbench.emulator.lens import Drift
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import EmulatorSpec
from workbench.emulator.spot import Spot
from workbench.model.arrays import Float32Array, Image


@dataclass(frozen=True)
class Exposure:
    """What one frame was exposed to."""

    spots: tuple[Spot, ...]
    picture: Float32Array | None
    """What room light shows, see `BenchScene.picture`."""
    lit: bool
    key: str
    number: int
    """Counts the frames of one capture key from 0."""
    exposure_s: float
    gain: float


MICRO = 1e-6


class EmulatedCamera:
    """Camera of the virtual bench.

    `exposure_s` (None: metered at every placement) and `gain` may be set at any time and hold from the next
    frame on; `set_exposure` sets it in microseconds, unless the rig file fixes it. `discard_frames` is what
    the driver believes the latency to be: `grab` throws that many away.
    """

    def __init__(
        self,
        spec: EmulatorSpec,
        scene: BenchScene,
        sensor: ImageSensor,
        lasers: Callable[[], tuple[str, ...]],
    ) -> None:
        self._spec, self._scene, self._sensor, self._lasers = spec, scene, sensor, lasers
        self.exposure_s = spec.camera.exposure_s
        self.exposure_unit = "us"
        limits = (spec.camera.shortest_exposure_s / MICRO, spec.camera.longest_exposure_s / MICRO)
        self.exposure_limits = None if self.exposure_s is not None else limits
        self.gain = spec.camera.gain
        self.discard_frames = spec.camera.latency_frames
        self._key, self._number = "", 0
        self._frames = 0
        self._metered: tuple[int, float, float] | None = None
        self._last: Frame | None = None
        self._for_room_light = False
        self._queue: deque[Exposure] = deque(self._expose(()) for _ in range(spec.camera.latency_frames))

    def mark(self, key: str) -> None:
        """Name the capture about to be taken; its frames' noise belongs to the name."""
        self._key, self._number = key, 0

    def grab(self) -> Frame:
        """A frame whose exposure began after this call, `discard_frames` frames being on their way."""
        for _ in range(self.discard_frames):
            self._next()
        return self.read()

    def grab_ambient(self) -> Frame:
        """As `grab`, metered for room light alone whatever `exposure_s` says."""
        self._for_room_light = True
        try:
            return self.grab()
        finally:
            self._for_room_light = False

    def read(self) -> Frame:
        """The next frame of the stream, as old as the latency makes it."""
        while True:
            exposure = self._next()
            chance = generator(self._spec.seed, "stream", exposure.key, exposure.number).random(2)
            if chance[0] >= self._spec.camera.dropped:
                break
        if self._last is None or chance[1] >= self._spec.camera.repeated:
            self._last = self._develop(exposure)
        return self._last

    def set_exposure(self, exposure: float) -> float:
        """See `protocols.ExposableCamera`; microseconds."""
        self.exposure_s = exposure * MICRO
        return exposure

    def meter(self) -> float:
        """Exposure (s) that puts the brightest spot of the present placement at `metered_peak`, gain as set.

        As an automatic exposure does with all lasers lit, speckle and ambient light included; within the
        shortest and the longest exposure of the camera.
        """
        if self._metered is None or self._metered[:2] != (self._scene.moves, self.gain):
            spots = [spot for name in self._scene.laser_ids for spot in self._scene.spots(name)]
            self._metered = (self._scene.moves, self.gain, self._metered_for(spots))
        return self._metered[2]

    def close(self) -> None:
        """Nothing to release."""

    def _metered_for(self, spots: Sequence[Spot]) -> float:
        spec = self._spec.camera
        exposure = self._sensor.metered_exposure(spots, self.gain, spec.metered_peak)
        return min(max(exposure, spec.shortest_exposure_s), spec.longest_exposure_s)

    def _exposure_s(self) -> float:
        if self._for_room_light:
            return self._metered_for(())
        return self.meter() if self.exposure_s is None else self.exposure_s

    def _next(self) -> Exposure:
        """Expose a frame and take the oldest one that is on its way."""
        self._queue.append(self._expose(self._lasers()))
        return self._queue.popleft()

    def _expose(self, lit: tuple[str, ...]) -> Exposure:
        drift = self._drift()
        spots = tuple(spot for name in lit for spot in self._scene.spots(name, drift))
        picture = self._scene.picture(drift)
        exposure = Exposure(spots, picture, bool(lit), self._key, self._number, self._exposure_s(), self.gain)
        self._frames += 1
        self._number += 1
        return exposure

    def _drift(self) -> Drift:
        """State of the camera at the next frame."""
        warm, steady = self._spec.warm_up, self._spec.drift
        return Drift(
            f_scale=1 + warm.f_relative * float(np.exp(-self._frames / warm.time_constant_frames)),
            u_px=steady.u_px_per_frame * self._frames,
            v_px=steady.v_px_per_frame * self._frames,
        )

    def _develop(self, exposure: Exposure) -> Frame:
        rng = generator(self._spec.seed, "frame", exposure.key, exposure.number)
        ambient = self._ambient(exposure, float(rng.random()))
        image = self._sensor.expose(
            exposure.spots, exposure.exposure_s, exposure.gain, ambient, rng, exposure.picture
        )
        return Frame(_mirrored(image) if self._spec.camera.mirrored else image, time.time_ns())

    def _ambient(self, exposure: Exposure, phase: float) -> float:
        """Ambient light of one exposure: lamps at twice the mains frequency, averaged over it."""
        spec = self._spec.ambient
        cycles = 2 * spec.mains_hz * exposure.exposure_s
        flicker = 1 + spec.flicker_depth * float(np.sinc(cycles)) * float(np.cos(2 * np.pi * phase))
        return flicker * (1 if exposure.lit else 1 + spec.off_jump)


def _mirrored(image: Image) -> Image:
    """Left and right exchanged."""
    return image[:, ::-1].copy()
