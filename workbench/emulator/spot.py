"""Image of one beam on one surface, in electrons per second and pixel, without noise.

Radiometry. A surface patch under irradiance E (W/mm^2 of surface) has the radiance L = albedo E / pi in
every direction (Lambert). Let the lines of sight of a pixel, at angle alpha to the axis, cover d(x, y) in the
plane z = 1. Their solid angle is cos^3(alpha) d(x, y). The projected area of the pupil is A cos(alpha). The
pixel therefore receives L A cos^4(alpha) d(x, y). The obliquity of the surface adds no factor: a pixel sees a
longer patch of a tilted surface, which is foreshortened by the same factor. Integrated over the whole spot
this is P albedo A cos(alpha) cos(theta) / (pi r^2), with theta between the line of sight and the normal, and
r the distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.constants import c, h
from scipy.ndimage import gaussian_filter, shift

from workbench.emulator.beam import Beam
from workbench.emulator.keyed import generator
from workbench.emulator.lens import Lens, LinesOfSight, SightMap
from workbench.emulator.spec import EmulatorSpec
from workbench.emulator.speckle import SpeckleMap, speckle_field, subsamples
from workbench.emulator.surfaces import Surface
from workbench.model.arrays import Float32Array, FloatArray

OUTLINE_RADII = 3.0
"""Half size of a window in beam radii: there the beam is at exp(-18) of its peak; 5 sd of blur are added."""
SAMPLES_WITHOUT_SPECKLE = 4
"""Samples along a pixel's side where speckle comes from a map: beam and PSF are wider than half a pixel."""
LEAST_STREAK_PX = 0.02
"""Motion of a spot during an exposure below which it counts as still."""
STREAK_STEP_PX = 0.2
FAINTEST = 1e-8
"""Irradiance, relative to the brightest sample, below which nothing is looked up."""
LARGEST_WINDOW = 1_500_000
"""Largest number of samples; larger spots, from grazing incidence, are sampled more coarsely."""


@dataclass(frozen=True)
class SpotImage:
    """Window of a spot: electrons per second, (height, width), with its first pixel at (`left`, `top`)."""

    left: int
    top: int
    rate: Float32Array


@dataclass(frozen=True)
class ImageFormat:
    """Size of the image, pixels."""

    width: int
    height: int


@dataclass(frozen=True)
class PaintTables:
    """Tables of a bench for many spots: speckle of every pixel, and all lines of sight."""

    speckle: SpeckleMap
    sight: SightMap


def streaked(spot: SpotImage, motion_px: tuple[float, float], image: ImageFormat) -> SpotImage:
    """Spot that moves by (u, v) during the exposure, centred on the still one; itself if it hardly moves."""
    length = float(np.hypot(*motion_px))
    if length < LEAST_STREAK_PX:
        return spot
    margin = int(np.ceil(length / 2)) + 1
    wide = np.pad(spot.rate, margin)
    count = int(np.ceil(length / STREAK_STEP_PX)) + 1
    parts = (np.arange(count) + 0.5) / count - 0.5
    moved = np.mean([shift(wide, (p * motion_px[1], p * motion_px[0]), order=1) for p in parts], axis=0)
    left, top = spot.left - margin, spot.top - margin
    rows = slice(max(0, -top), min(len(moved), image.height - top))
    columns = slice(max(0, -left), min(moved.shape[1], image.width - left))
    return SpotImage(max(0, left), max(0, top), moved[rows, columns].astype(np.float32))


def grain_px(spec: EmulatorSpec) -> float:
    """Size of a speckle grain, lambda N, in pixels."""
    return spec.beam.wavelength_nm * 1e-6 * 1e3 * spec.lens.f_number / spec.sensor.pitch_um


class SpotPainter:
    """Renderer of beams on surfaces as seen by the camera.

    Args:
        spec: settings of the bench.
        lens: lens of the camera.
        image: size of the image.
        f_px: true focal length.
        tables: tables instead of speckle and lines of sight that are computed for each spot, which takes ten
            times longer; None: they are computed.
    """

    def __init__(
        self,
        spec: EmulatorSpec,
        lens: Lens,
        image: ImageFormat,
        f_px: float,
        tables: PaintTables | None = None,
    ) -> None:
        self._tables = tables
        self._spec = spec
        self._lens = lens
        self._image = image
        wavelength_mm = spec.beam.wavelength_nm * 1e-6
        self._grain_px = grain_px(spec)
        pupil_mm2 = np.pi / 4 * (f_px * spec.sensor.pitch_um * 1e-3 / spec.lens.f_number) ** 2
        electrons_per_joule = spec.sensor.quantum_efficiency * wavelength_mm * 1e-3 / (h * c)
        self._response = pupil_mm2 * spec.lens.transmission * electrons_per_joule / np.pi

    def paint(self, beam: Beam, surface: Surface, gain: float, key: Sequence[str]) -> SpotImage | None:
        """Image of a beam's spot with speckle by `key`; None if the camera does not see it.

        `gain` multiplies the surface's albedo, for reflections in a mirror.
        """
        box = self._window(beam, surface)
        if box is None:
            return None
        left, top, width, height = box
        n = subsamples(self._grain_px) if self._tables is None else SAMPLES_WITHOUT_SPECKLE
        n = max(2, min(n, int(np.sqrt(LARGEST_WINDOW / (width * height)))))
        samples = self._samples(beam, surface, box, n)
        blur = self._spec.lens.blur_px * n
        if blur > 0:
            samples = gaussian_filter(samples, blur, mode="constant", truncate=5.0)
        rng = generator(self._spec.seed, "speckle", *key)
        if self._spec.beam.speckle_contrast > 0 and self._tables is None:
            contrast = self._spec.beam.speckle_contrast
            samples *= speckle_field(samples.shape, 1 / n, self._grain_px, contrast, rng)
        rate = samples.reshape(height, n, width, n).mean(axis=(1, 3)) * (
            self._response * surface.albedo * gain
        )
        if self._tables is not None:
            rate *= self._tables.speckle.cut(rate.shape, rng)
        return SpotImage(left, top, rate.astype(np.float32)) if rate.max() > 0 else None

    def _window(self, beam: Beam, surface: Surface) -> tuple[int, int, int, int] | None:
        """Left, top, width, height of the pixels that the spot may touch; None if there are none."""
        origins, directions = beam.outline(OUTLINE_RADII, 32)
        origins, directions = np.vstack([origins, beam.origin]), np.vstack([directions, beam.direction])
        depths = surface.depth(origins, directions)
        if np.isnan(depths).all():
            return None
        depths = np.where(np.isnan(depths), np.nanmedian(depths), depths)
        pixels = self._lens.project(origins + depths[:, None] * directions)
        margin = 5 * self._spec.lens.blur_px + 1.5
        low = np.floor(pixels.min(axis=0) - margin)
        high = np.ceil(pixels.max(axis=0) + margin) + 1
        size = (self._image.width, self._image.height)
        left, top = (int(np.clip(a, 0, s)) for a, s in zip(low, size, strict=True))
        right, bottom = (int(np.clip(a, 0, s)) for a, s in zip(high, size, strict=True))
        return (left, top, right - left, bottom - top) if right > left and bottom > top else None

    def _sight(self, box: tuple[int, int, int, int], u: FloatArray, v: FloatArray) -> LinesOfSight:
        if self._tables is not None:
            return self._tables.sight.grid(u, v)
        left, top, width, height = box
        around_u, around_v = np.arange(left - 2.0, left + width + 2), np.arange(top - 2.0, top + height + 2)
        return self._lens.back_project_grid(around_u, around_v, u, v)

    def _samples(self, beam: Beam, surface: Surface, box: tuple[int, int, int, int], n: int) -> FloatArray:
        """Power of n x n points per pixel, each as if it filled the pixel: E cos^4(alpha) d(x, y)."""
        left, top, width, height = box
        offsets = (np.arange(n) + 0.5) / n - 0.5
        u = (np.arange(left, left + width)[:, None] + offsets).ravel()
        v = (np.arange(top, top + height)[:, None] + offsets).ravel()
        sight = self._sight(box, u, v)
        direction = np.column_stack([sight.x.ravel(), sight.y.ravel(), np.ones(sight.x.size)])
        depth = surface.depth(np.zeros(3), direction)
        power = np.zeros(len(depth))
        met = np.isfinite(depth)
        points = depth[met, None] * direction[met]
        cos2 = 1 / np.einsum("ij,ij->i", direction[met], direction[met])
        lit = beam.irradiance(points, surface.normal(points)) * surface.shade(points)
        bright = np.flatnonzero(lit > FAINTEST * lit.max(initial=0.0))
        if len(bright):
            lit[bright] *= surface.unhidden(beam.origin, points[bright])
            if not lit[bright].any():
                lit[:] = 0.0
        power[met] = lit * cos2**2 * sight.area.ravel()[met]
        return power.reshape(height * n, width * n)
