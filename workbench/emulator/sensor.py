"""Image sensor: noise, hot pixels, ambient light, gain, saturation, quantisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from workbench.emulator.keyed import generator
from workbench.emulator.spec import EmulatorSpec
from workbench.emulator.spot import ImageFormat, SpotImage
from workbench.model.arrays import Float32Array, Image

CLUTTER_THINGS = 40


class ImageSensor:
    """Grey sensor with linear response; pixel values are clipped to [0, 2^bits - 1]."""

    def __init__(self, spec: EmulatorSpec, image: ImageFormat, bits: int) -> None:
        self._spec = spec.sensor
        self._full_scale = 2**bits - 1
        self._ambient = _ambient_map(spec, image)
        self._hot = _hot_map(spec, image)
        self._brightest_ambient = float(self._ambient.max())

    def expose(
        self,
        spots: Sequence[SpotImage],
        exposure_s: float,
        gain: float,
        ambient: float,
        rng: Generator,
        picture: Float32Array | None = None,
    ) -> Image:
        """Expose one frame.

        Shot noise is Poisson noise in the windows of spots, and its Gaussian approximation elsewhere, where
        the read noise dominates; both have the correct mean and variance.

        Args:
            spots: images of spots.
            exposure_s: exposure.
            gain: gain, 1 at the full well.
            ambient: factor of the ambient light.
            rng: generator of the noise.
            picture: further factor of the ambient light for each pixel, (height, width).
        """
        mean = self._ambient * np.float32(ambient * exposure_s)
        if picture is not None:
            mean *= picture
        mean += self._hot * np.float32(exposure_s)
        for spot in spots:
            _window(mean, spot)[:] += spot.rate * np.float32(exposure_s)
        noise = rng.standard_normal(mean.shape, dtype=np.float32)
        read = [np.float32(self._spec.read_noise_e) * _window(noise, spot) for spot in spots]
        noise *= np.sqrt(mean + np.float32(self._spec.read_noise_e**2))
        noise += mean
        for spot, of_reading in zip(spots, read, strict=True):
            _window(noise, spot)[:] = rng.poisson(_window(mean, spot)) + of_reading
        if self._spec.blooming > 0:
            _spill(noise, self._spec.full_well_e, self._spec.blooming, self._spec.blooming_up)
        return self._digitise(noise, gain)

    def metered_exposure(self, spots: Sequence[SpotImage], gain: float, peak: float) -> float:
        """Exposure (s) at which the brightest pixel of `spots` is at the fraction `peak` of full scale."""
        rate = max((float(spot.rate.max()) for spot in spots), default=0.0) + self._brightest_ambient
        level = (peak - self._spec.black_level) * self._spec.full_well_e / gain
        return level / rate if rate > 0 else float("inf")

    def _digitise(self, electrons: Float32Array, gain: float) -> Image:
        electrons *= np.float32(gain * self._full_scale / self._spec.full_well_e)
        electrons += np.float32(self._spec.black_level * self._full_scale)
        np.rint(electrons, out=electrons)
        np.clip(electrons, 0, self._full_scale, out=electrons)
        return electrons.astype(np.uint8) if self._full_scale < 256 else electrons.astype(np.uint16)


def _spill(electrons: Float32Array, full_well_e: float, share: float, up: float) -> None:
    """Move charge beyond the full well along its column, into the next pixels that have room.

    Args:
        electrons: (height, width) charge, changed in place.
        full_well_e: charge that a pixel holds.
        share: share of the excess that spills; the rest is drained.
        up: share of the spilled charge that runs to smaller rows.
    """
    excess = np.maximum(electrons - full_well_e, 0.0)
    columns = np.flatnonzero(excess.any(axis=0))
    np.minimum(electrons, full_well_e, out=electrons)
    for part, rows in (
        (up * share, range(len(electrons) - 1, -1, -1)),
        ((1.0 - up) * share, range(len(electrons))),
    ):
        carried = np.zeros(len(columns), np.float32)
        for row in rows:
            carried += part * excess[row, columns]
            room = full_well_e - electrons[row, columns]
            taken = np.minimum(carried, room)
            electrons[row, columns] += taken
            carried -= taken


def _window(image: Float32Array, spot: SpotImage) -> Float32Array:
    height, width = spot.rate.shape
    return image[spot.top : spot.top + height, spot.left : spot.left + width]


def _ambient_map(spec: EmulatorSpec, image: ImageFormat) -> Float32Array:
    ambient = spec.ambient
    u = (np.arange(image.width) / max(image.width - 1, 1) - 0.5) * ambient.gradient_u
    v = (np.arange(image.height) / max(image.height - 1, 1) - 0.5) * ambient.gradient_v
    light = 1 + u[None, :] + v[:, None]
    rng = generator(spec.seed, "clutter")
    for left, right, top, bottom, tone in rng.random((CLUTTER_THINGS, 5)):
        columns = slice(*sorted((int(left * image.width), int(right * image.width))))
        rows = slice(*sorted((int(top * image.height), int(bottom * image.height))))
        light[rows, columns] *= 1 + ambient.clutter * (2 * tone - 1)
    return (ambient.level_e_per_s * light).astype(np.float32)


def _hot_map(spec: EmulatorSpec, image: ImageFormat) -> Float32Array:
    rng = generator(spec.seed, "hot pixels")
    pixels = np.zeros(image.width * image.height, dtype=np.float32)
    count = min(spec.sensor.hot_pixels, pixels.size)
    where = rng.choice(pixels.size, size=count, replace=False)
    pixels[where] = rng.exponential(spec.sensor.hot_pixel_e_per_s, size=count)
    return pixels.reshape(image.height, image.width)
