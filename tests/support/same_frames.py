"""The thesis's chain and the workbench's on the same frames of a flat."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.ranging.ranger import Ranger, Reading
from workbench.spots import find_spots
from workbench.spots.threshold_centroid import thesis_centres
from workbench.trials.thesis import camera, thesis_chain
from workbench.trials.thesis.scene import LaserLine
from workbench.trials.thesis.workbench_chain import Chain

ALL = np.ones(4, bool)
SPAN_MM = (45.0, 5000.0)


@dataclass(frozen=True)
class SameFrames:
    """Frames of flats, ranged by both chains."""

    line: LaserLine
    noisy: bool
    rng: np.random.Generator

    @cached_property
    def _ranger(self) -> Ranger:
        return Chain(self.line, self.noisy, SPAN_MM).ranger

    def read(self, range_mm: float) -> tuple[float | None, Reading | None]:
        """Closest range by the thesis's chain, mm, and our reading; None where a chain has not four spots."""
        depths = np.full(4, range_mm)
        spots = self.line.spots_px(depths)
        if self.noisy:
            spots = spots + self.line.speckle_sd_px * self.rng.standard_normal(4)
        on, off = camera.expose(self.line, depths, spots, ALL, self.rng if self.noisy else None)
        ranger = self._ranger
        centres = np.sort(thesis_centres(on, off, scanlines=ranger.scanlines[:1], expected=4)[:, 0])
        found = find_spots(on, off, scanlines=ranger.scanlines, expected=4).spots
        ours = ranger.read_lit("a", found) if len(found) == 4 else None
        return (self._by_thesis(centres) if len(centres) == 4 else None), ours

    def _by_thesis(self, centres: np.ndarray) -> float | None:
        lasers = np.arange(4)
        ranges = thesis_chain.ranges_mm(self.line, lasers, centres)
        sigmas = thesis_chain.sigmas_mm(self.line, lasers, centres)
        return thesis_chain.shape_of(self.line, lasers, ranges, sigmas).closest_mm
