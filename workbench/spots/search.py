"""Search of `SpotFinder`: detection, fits, deblending, failures."""

from __future__ import annotations

from typing import Final

import numpy as np

from workbench.model.arrays import Image
from workbench.model.spot import NO_FLAGS, Failure, Spot
from workbench.spots.blooming import with_blooming
from workbench.spots.deblending.blend import fit_blends, split_elongated, with_hidden_spots
from workbench.spots.deblending.clusters import (
    CLEAR_SNR,
    are_separate,
    clusters,
    without_duplicates,
    without_rivals,
)
from workbench.spots.detect import COARSE_PX, FINE_PX, Peaks, find_peaks
from workbench.spots.measure import FittedSpot, measure
from workbench.spots.noise import stated_contrast2
from workbench.spots.pair import Pair, PairSignal, measure_signal
from workbench.spots.strip import Strip, is_on, strip_of
from workbench.spots.types import Finding, Scanline

# Lowest height of a peak that is reported as too dim, in sd of the smoothed noise.
_DIM_SD: Final = 4.2
# Peak of a spot, in sd of a pixel, below which it is dropped where there are more spots than lasers.
_CLEAR_PEAK_SD: Final = 5.0


class Search:
    """Search in frames of one size; arguments as in `SpotFinder`."""

    def __init__(
        self,
        shape: tuple[int, int],
        scanlines: tuple[Scanline, ...],
        expected: int | None,
        speckle_sd_px: float,
        reasons: bool,
    ) -> None:
        self._lines = scanlines
        self._wants_reasons = reasons
        self._expected = expected
        self._contrast2 = stated_contrast2(speckle_sd_px)
        self._everywhere = Strip(slice(0, shape[0]), slice(0, shape[1]), None)
        strips = tuple(strip_of(line, shape) for line in scanlines) or (self._everywhere,)
        self._strips = tuple(s for s in strips if s.rows.stop > s.rows.start and s.cols.stop > s.cols.start)

    def find(self, on: Image, off: Image | None, clip_dn: float) -> Finding:
        """Spots and failures of a checked pair of frames."""
        pair = Pair(on, off, clip_dn, stated_contrast2=self._contrast2)
        scenes = [measure_signal(pair, strip) for strip in self._strips]
        fits = self._search(scenes)
        found = [t.spot for t in fits if self._on_a_line(t.spot)]
        spots = self._in_order([with_blooming(spot, on, clip_dn) for spot in found])
        return Finding(tuple(spots), self._failures(pair, scenes, fits, spots))

    def _search(self, scenes: list[PairSignal]) -> list[FittedSpot]:
        """Spots of all strips, by the cheapest search that explains the frame.

        Peaks are searched at a fine scale first, then at a coarse one: smoothing with the width of a spot
        maximises its signal-to-noise ratio (matched filter). With as many clear, separate spots as lasers on,
        the result is final: the common case. Otherwise overlapping spots are fitted jointly, and elongated
        ones are tried as two; while spots are still missing, they are searched in the residuals of the joint
        fits. Each addition must pass the F test of `deblending.blend`.
        """
        fits: list[FittedSpot] = []
        for scale in (FINE_PX, COARSE_PX):
            for scene in scenes:
                peaks = find_peaks(scene.signal, scene.strip, scene.variance, scale)
                clear = [t for t in fits if t.flux_snr >= CLEAR_SNR]
                fits = without_rivals(fits, measure(scene, _unexplained(peaks, clear)))
            if self._is_complete(fits) and are_separate(fits):
                return fits
            fits = without_duplicates(fits)
            if self._is_complete(fits):
                break
        if not fits or (len(fits) == self._expected and are_separate(fits)):
            return fits
        more = self._wants_more(fits)
        if more:
            fits = [s for t in fits for s in split_elongated(scenes, t, _without(fits, [t]))]
        groups = [fit_blends(scenes, g, _without(fits, g), more) for g in clusters(fits)]
        fits = without_duplicates([fit for group in groups for fit in group])
        if self._wants_more(fits):
            found = [t for g in clusters(fits) for t in with_hidden_spots(scenes, g, _without(fits, g))]
            fits = without_duplicates(found)
        return self._without_dim_extras(fits, scenes)

    def _wants_more(self, fits: list[FittedSpot]) -> bool:
        """Whether more spots may be found: the number of lasers is unknown, or not reached."""
        return self._expected is None or len(fits) < self._expected

    def _is_complete(self, fits: list[FittedSpot]) -> bool:
        """Whether every laser has a significant spot."""
        return len(fits) == self._expected and all(t.flux_snr >= CLEAR_SNR for t in fits)

    def _without_dim_extras(self, fits: list[FittedSpot], scenes: list[PairSignal]) -> list[FittedSpot]:
        """Fits without dim ones in excess of the number of lasers."""
        if self._expected is None or len(fits) <= self._expected:
            return fits
        clear = _CLEAR_PEAK_SD * min(scene.variance for scene in scenes) ** 0.5
        ranked = sorted(fits, key=lambda t: -t.spot.peak_dn)
        return [t for i, t in enumerate(ranked) if i < self._expected or t.spot.peak_dn > clear]

    def _on_a_line(self, spot: Spot) -> bool:
        for line in self._lines:  # not any(...): a generator for each spot is a hundredth of the search
            if is_on(line, spot.u_px, spot.v_px):
                return True
        return not self._lines

    def _in_order(self, spots: list[Spot]) -> list[Spot]:
        du, dv = (self._lines[0].du, self._lines[0].dv) if self._lines else (1.0, 0.0)
        return sorted(spots, key=lambda s: (s.u_px * du + s.v_px * dv, s.v_px))

    def _failures(
        self, pair: Pair, scenes: list[PairSignal], fits: list[FittedSpot], spots: list[Spot]
    ) -> tuple[Failure, ...]:
        failures = [Failure.AMBIENT_CHANGED] if any(s.ambient_changed for s in scenes) else []
        if len(spots) < len(fits):
            failures.append(Failure.OFF_SCANLINE)
        if not fits and self._wants_reasons and self._is_exchanged(pair):
            failures.append(Failure.ON_OFF_EXCHANGED)
        if not spots or (self._expected is not None and len(spots) < self._expected):
            failures.append(Failure.TOO_FEW if spots else Failure.NO_SPOT)
            failures += self._reasons(pair, scenes, spots) if self._wants_reasons else []
        if self._expected is not None and len(spots) > self._expected:
            failures.append(Failure.TOO_MANY)
        if flags := NO_FLAGS.union(*(s.flags for s in spots)):
            failures += [f for f in Failure if f in flags]
        return tuple(dict.fromkeys(failures))

    def _is_exchanged(self, pair: Pair) -> bool:
        """Whether spots are in the frame with the lasers off instead."""
        if pair.off is None:
            return False
        exchanged = Pair(pair.off, pair.on, pair.clip_dn, stated_contrast2=self._contrast2)
        return bool(self._search([measure_signal(exchanged, strip) for strip in self._strips]))

    def _reasons(self, pair: Pair, scenes: list[PairSignal], spots: list[Spot]) -> list[Failure]:
        """Reasons for missing spots: too dim, or outside the band (for which the whole frame is searched)."""
        reasons = []
        for scene in scenes:
            dim = find_peaks(scene.signal, scene.strip, scene.variance, threshold_sd=_DIM_SD)
            near = np.array(
                [
                    [np.hypot(s.u_px - c, s.v_px - r) < 5 * s.width_px + 2 for s in spots]
                    for r, c in zip(dim.rows, dim.cols, strict=True)
                ],
                bool,
            )
            if dim.rows.size and not near.reshape(dim.rows.size, -1).any(axis=1).all():
                reasons.append(Failure.TOO_DIM)
        if self._lines:
            scene = measure_signal(pair, self._everywhere)
            elsewhere = measure(scene, find_peaks(scene.signal, scene.strip, scene.variance))
            if any(not self._on_a_line(t.spot) for t in elsewhere):
                reasons.append(Failure.OFF_SCANLINE)
        return reasons


def _without(fits: list[FittedSpot], group: list[FittedSpot]) -> list[FittedSpot]:
    """Fits that are not in a group."""
    members = {id(t) for t in group}
    return [t for t in fits if id(t) not in members]


def _unexplained(peaks: Peaks, fits: list[FittedSpot]) -> Peaks:
    """Peaks outside the reach of all measured spots."""
    if not fits or peaks.rows.size == 0:
        return peaks
    u = np.array([t.spot.u_px for t in fits])
    v = np.array([t.spot.v_px for t in fits])
    reach = np.array([3.0 * t.reach_px + 2.0 * peaks.scale_px for t in fits])
    distance_px = np.hypot(peaks.cols[:, None] - u, peaks.rows[:, None] - v)
    new = (distance_px > reach).all(axis=1)
    return Peaks(peaks.rows[new], peaks.cols[new], peaks.height_dn[new], peaks.scale_px)
