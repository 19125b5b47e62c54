"""Scenes drawn at random in front of the thesis's two lines: frames, spots, and readings as numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property
from zlib import crc32

import numpy as np

from tests.benchmarks.render import Sensor, spot
from workbench.model.arrays import FloatArray, Image
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.spots import Finding, SpotFinder

KINDS = ("flat", "far", "incline", "cylinder", "steps", "one lost", "two lost", "dim", "clipped", "stray")
SHAPE = (480, 640)
SENSOR = Sensor(electrons_per_dn=10.0, read_sd_electrons=5.0, bits=8, black_dn=0.0)
AMBIENT_ELECTRONS = 120.0
BRIGHT_ELECTRONS = 15_000.0
SPECKLE_SD_PX = 0.04
HALF_PX = 24
"""Half the side of the square that a spot lights."""
OFF_FRAMES = 5
COLUMNS = ("u_px", "v_px", "u_sd_px", "v_sd_px", "flux_dn", "width_px", "u_speckle_sd_px", "v_speckle_sd_px")


@dataclass(frozen=True)
class DrawnScene:
    """A scene of one kind, drawn by a seed."""

    ranger: Ranger
    kind: str
    seed: int
    captured: list[Finding] = field(default_factory=list)
    """Spots of every capture."""

    @cached_property
    def _rng(self) -> np.random.Generator:
        return np.random.default_rng([KINDS.index(self.kind), self.seed])

    @cached_property
    def _places(self) -> dict[str, FloatArray]:
        """(2,) pixel of the spot of each laser that has one."""
        ids, sensor, rng = list(self.ranger.sensor.ids), self.ranger.sensor, self._rng
        closest = rng.uniform(1800, 4400) if self.kind == "far" else rng.uniform(200, 1800)
        slope = rng.uniform(-0.7, 0.7) if self.kind == "incline" else 0.0
        places = {}
        for laser_id, (x, y) in zip(ids, sensor.positions_mm(ids, np.full(len(ids), closest)).T, strict=True):
            depth = closest + slope * (x + y)
            if self.kind == "cylinder":
                depth += 89.0 - np.sqrt(89.0**2 - (x - 10.0) ** 2)
            if self.kind == "steps":
                depth *= rng.uniform(0.6, 1.7)
            pixel = sensor.spot_px(laser_id, np.array([depth]))[0]
            places[laser_id] = pixel + SPECKLE_SD_PX * rng.standard_normal(2)
        lost = {"one lost": 1, "two lost": 2}.get(self.kind, 0)
        for laser_id in rng.choice(ids, lost, replace=False).tolist():
            del places[laser_id]
        return places

    @cached_property
    def _light(self) -> tuple[float, float]:
        """Electrons and width of a spot."""
        bright = {"dim": 600.0, "clipped": 6.0 * BRIGHT_ELECTRONS}.get(self.kind, BRIGHT_ELECTRONS)
        return bright * self._rng.uniform(0.7, 1.3), self._rng.uniform(1.2, 2.4)

    def read(self) -> Reading:
        """One reading; every capture is kept."""
        return acquire(self.ranger, "", self._capture)

    def _capture(self, fired: tuple[str, ...]) -> Finding:
        on, off = self._frames(fired)
        searched = self.ranger.searched(fired)
        finder = SpotFinder(SHAPE, searched, expected=len(fired), speckle_sd_px=SPECKLE_SD_PX, reasons=False)
        self.captured.append(finder.find(on, off))
        return self.captured[-1]

    def _frames(self, fired: tuple[str, ...]) -> tuple[Image, Image]:
        """Frame with the lasers on, and one with them off."""
        lit = [place for laser_id, place in self._places.items() if laser_id in fired]
        electrons, width = self._light
        rng = np.random.default_rng([self.seed, *(self.ranger.sensor.ids.index(i) for i in fired)])
        if self.kind == "stray":
            lit = [*lit, np.array([rng.uniform(60, 580), 240 + rng.uniform(-8, 8)])]
        light, is_lit = np.full(SHAPE, AMBIENT_ELECTRONS), np.zeros(SHAPE, bool)
        for place in lit:
            col, row = (
                int(np.clip(round(at), HALF_PX, end - HALF_PX - 1)) - HALF_PX
                for at, end in zip(place, SHAPE[::-1], strict=True)
            )
            square = slice(row, row + 2 * HALF_PX + 1), slice(col, col + 2 * HALF_PX + 1)
            share = spot(light[square].shape, place[0] - col, place[1] - row, width, width)
            light[square] += electrons * share
            is_lit[square] = True
        on, off = off_frame(self.seed % OFF_FRAMES).copy(), off_frame((self.seed + 1) % OFF_FRAMES)
        on[is_lit] = SENSOR.expose(light[is_lit], rng)
        return on, off


@cache
def off_frame(number: int) -> Image:
    """A frame of the ambient light alone."""
    return SENSOR.expose(np.full(SHAPE, AMBIENT_ELECTRONS), np.random.default_rng(number))


NUMBERS = (
    "spots",
    "flags",
    *COLUMNS,
    "status",
    "notes",
    "closest_mm",
    "sigma_mm",
    "low_mm",
    "high_mm",
    "mean_mm",
    "mean_sigma_mm",
    "flat_mm",
    "flat_sigma_mm",
    "flat_spot_sd_mm",
    "flat_at_mm",
    "ranges_mm",
    "sigmas_mm",
    "angle_rad",
    "probabilities",
    "p_values",
)
"""Names of the numbers of a scene."""


def numbers_of(scene: DrawnScene) -> list[float]:
    """Numbers of a scene's spots and of its reading, in the order of `NUMBERS`; NaN where there is none.

    Spots of all captures, ranges and probabilities enter by weighted sums, texts by a checksum.
    """
    reading = scene.read()
    spots = [spot for finding in scene.captured for spot in finding.spots]
    shapes = [line.shape for line in reading.lines]
    optional = (
        reading.closest_mm,
        reading.sigma_mm,
        *(reading.interval_mm or (None, None)),
        reading.mean_mm,
        reading.mean_sigma_mm,
        reading.flat_mm,
        reading.flat_sigma_mm,
        reading.flat_spot_sd_mm,
    )
    return [
        float(len(spots)),
        _checksum([sorted(flag.value for flag in one.flags) for one in spots]),
        *(_weighted(getattr(one, name) or 0.0 for one in spots) for name in COLUMNS),
        _checksum((reading.status, *(shape.kind for shape in shapes))),
        _checksum(reading.notes),
        *(np.nan if value is None else float(value) for value in optional),
        sum(reading.flat_at_mm),
        _weighted(one.range_mm for one in reading.lasers),
        _weighted(one.sigma_mm for one in reading.lasers),
        sum(shape.angle_rad or 0.0 for shape in shapes),
        sum(_weighted(shape.probabilities.values()) for shape in shapes),
        sum(_weighted(test.probability or 0.0 for test in shape.tried) for shape in shapes),
    ]


def _weighted(values: Iterable[float]) -> float:
    """Sum in which every value has another weight."""
    return float(sum(n * value for n, value in enumerate(values, 1)))


def _checksum(texts: object) -> float:
    return float(crc32(repr(texts).encode()))
