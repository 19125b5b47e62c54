"""Emulated camera: a stream of frames, and the driver that grabs from it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.devices.protocols import Frame
from workbench.emulator.clock import SimulatedClock
from workbench.emulator.keyed import generator
from workbench.emulator.lens import Drift
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import EmulatorSpec
from workbench.emulator.spot import SpotImage
from workbench.model.arrays import Float32Array, Image


@dataclass(frozen=True)
class Exposure:
    """Light and settings of one frame."""

    spots: tuple[SpotImage, ...]
    picture: Float32Array | None
    """Board in room light, see `BenchScene.picture`."""
    lit: bool
    key: str
    number: int
    """Number of the frame within its capture key, from 0."""
    exposure_s: float
    gain: float


MICRO = 1e-6


class EmulatedCamera:
    """Camera of the virtual bench.

    `exposure_s` (None: metered at every placement) and `gain` may be set at any time. They apply from the
    next frame on. `set_exposure` sets the exposure in microseconds, unless the rig file fixes it.
    `discard_frames` is the assumed latency: the number of frames that `grab` discards.
    """

    def __init__(
        self,
        spec: EmulatorSpec,
        scene: BenchScene,
        sensor: ImageSensor,
        lasers: Callable[[], tuple[str, ...]],
    ) -> None:
        self.clock = SimulatedClock()
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
        """Set the key of the next capture, from which the noise of its frames is derived.

        With the same key again, the capture is repeated: a lease may have ended before its last frame.
        """
        self.clock.switch(again=key == self._key)
        self._key, self._number = key, 0

    def grab(self) -> Frame:
        """Frame after discarding `discard_frames` frames."""
        for _ in range(self.discard_frames):
            self.clock.expose(self._exposure_s())
            self._next()
        return self.read()

    def grab_ambient(self) -> Frame:
        """Frame as from `grab`, metered for room light regardless of `exposure_s`."""
        self._for_room_light = True
        try:
            return self.grab()
        finally:
            self._for_room_light = False

    def read(self) -> Frame:
        """Next frame of the stream, delayed by the latency.

        Frames that are lost in transfer take no time: which are lost depends on frames before the capture.
        """
        self.clock.expose(self._exposure_s())
        while True:
            exposure = self._next()
            chance = generator(self._spec.seed, "stream", exposure.key, exposure.number).random(2)
            if chance[0] >= self._spec.camera.dropped:
                break
        if self._last is None or chance[1] >= self._spec.camera.repeated:
            self._last = self._develop(exposure)
        return self._last

    def set_exposure(self, exposure: float) -> float:
        """Set the exposure in microseconds, see `protocols.ExposableCamera`."""
        self.exposure_s = exposure * MICRO
        return exposure

    def meter(self) -> float:
        """Exposure (s) at which the brightest spot of the present placement is at `metered_peak`.

        Like an automatic exposure with all lasers on, including speckle and ambient light, within the
        shortest and the longest exposure of the camera.
        """
        if self._metered is None or self._metered[:2] != (self._scene.moves, self.gain):
            spots = [spot for name in self._scene.laser_ids for spot in self._scene.spots(name)]
            self._metered = (self._scene.moves, self.gain, self._metered_for(spots))
        return self._metered[2]

    def close(self) -> None:
        """Return at once: there is no device to release."""

    def _metered_for(self, spots: Sequence[SpotImage]) -> float:
        spec = self._spec.camera
        exposure = self._sensor.metered_exposure(spots, self.gain, spec.metered_peak)
        return min(max(exposure, spec.shortest_exposure_s), spec.longest_exposure_s)

    def _exposure_s(self) -> float:
        if self._for_room_light:
            return self._metered_for(())
        return self.meter() if self.exposure_s is None else self.exposure_s

    def _next(self) -> Exposure:
        """Expose a frame and return the oldest one in the stream."""
        self._queue.append(self._expose(self._lasers()))
        return self._queue.popleft()

    def _expose(self, lit: tuple[str, ...]) -> Exposure:
        drift, exposure_s = self._drift(), self._exposure_s()
        spots = tuple(spot for name in lit for spot in self._scene.spots(name, drift, exposure_s))
        picture = self._scene.picture(drift)
        exposure = Exposure(spots, picture, bool(lit), self._key, self._number, exposure_s, self.gain)
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
        """Relative ambient light, averaged over one exposure; lamps flicker at twice the mains frequency."""
        spec = self._spec.ambient
        cycles = 2 * spec.mains_hz * exposure.exposure_s
        flicker = 1 + spec.flicker_depth * float(np.sinc(cycles)) * float(np.cos(2 * np.pi * phase))
        return flicker * (1 if exposure.lit else 1 + spec.off_jump)


def _mirrored(image: Image) -> Image:
    """Image with left and right exchanged."""
    return image[:, ::-1].copy()
