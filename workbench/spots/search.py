"""The search behind `SpotFinder`: peaks, fits, overlaps, and what went wrong."""

from __future__ import annotations

from typing import Final

import numpy as np

from workbench.model.arrays import Image
from workbench.model.spot import NO_FLAGS, Failure, Spot
from workbench.spots.deblending.blend import fit_blends, grown, split
from workbench.spots.deblending.clusters import CLEAR_SD, are_apart, clearest, clusters, without_duplicates
from workbench.spots.detect import COARSE_PX, FINE_PX, Peaks, find_peaks
from workbench.spots.measure import FittedSpot, measure
from workbench.spots.pair import Pair, PairSignal, measure_signal
from workbench.spots.strip import Strip, is_on, strip_of
from workbench.spots.types import Finding, Scanline

# A peak of the smoothed signal between this and the threshold is named: too dim to be told from noise.
_DIM_SD: Final = 4.2
# A spot whose peak is this many sd of a pixel is clear; one that is not has to give way when there are too
# many.
_CLEAR_PEAK_SD: Final = 5.0


class Search:
    """A search of frames of one size; see `SpotFinder` for the arguments."""

    def __init__(
        self, shape: tuple[int, int], scanlines: tuple[Scanline, ...], expected: int | None, reasons: bool
    ) -> None:
        self._lines = scanlines
        self._wants_reasons = reasons
        self._expected = expected
        self._everywhere = Strip(slice(0, shape[0]), slice(0, shape[1]), None)
        strips = tuple(strip_of(line, shape) for line in scanlines) or (self._everywhere,)
        self._strips = tuple(s for s in strips if s.rows.stop > s.rows.start and s.cols.stop > s.cols.start)

    def find(self, on: Image, off: Image | None, clip_dn: float) -> Finding:
        """Spots of a pair of frames that were checked."""
        pair = Pair(on, off, clip_dn)
        scenes = [measure_signal(pair, strip) for strip in self._strips]
        traces = self._search(scenes)
        spots = self._in_order([t.spot for t in traces if self._on_a_line(t.spot)])
        return Finding(tuple(spots), self._failures(pair, scenes, traces, spots))

    def _search(self, scenes: list[PairSignal]) -> list[FittedSpot]:
        """Spots of all strips, by the cheapest search that explains the frame.

        Peaks are searched at a fine scale first, then at a coarse one: smoothing with the width of a spot
        maximises its signal-to-noise ratio (matched filter). With as many clear, separate spots as lasers on,
        the result is final: the common case. Otherwise overlapping spots are fitted jointly, and elongated
        ones are tried as two; while spots are still missing, they are searched in the residuals of the joint
        fits. Each addition must pass the F test of `deblending.blend`.
        """
        traces: list[FittedSpot] = []
        for scale in (FINE_PX, COARSE_PX):
            for scene in scenes:
                peaks = find_peaks(scene.signal, scene.strip, scene.variance, scale)
                clear = [t for t in traces if t.clarity >= CLEAR_SD]
                traces = clearest(traces, measure(scene, _new_ones(peaks, clear)))
            if self._is_complete(traces) and are_apart(traces):
                return traces
            traces = without_duplicates(traces)
            if self._is_complete(traces):
                break
        if not traces or (len(traces) == self._expected and are_apart(traces)):
            return traces
        more = self._wants_more(traces)
        if more:
            traces = [s for t in traces for s in split(scenes, t, _without(traces, [t]))]
        groups = [fit_blends(scenes, g, _without(traces, g), more) for g in clusters(traces)]
        traces = without_duplicates([trace for group in groups for trace in group])
        if self._wants_more(traces):
            found = [t for g in clusters(traces) for t in grown(scenes, g, _without(traces, g))]
            traces = without_duplicates(found)
        return self._as_many_as_lasers(traces, scenes)

    def _wants_more(self, traces: list[FittedSpot]) -> bool:
        return self._expected is None or len(traces) < self._expected

    def _is_complete(self, traces: list[FittedSpot]) -> bool:
        """Whether every laser has a spot that is no spike of noise."""
        return len(traces) == self._expected and all(t.clarity >= CLEAR_SD for t in traces)

    def _as_many_as_lasers(self, traces: list[FittedSpot], scenes: list[PairSignal]) -> list[FittedSpot]:
        """The traces without the dim ones that are more than there are lasers."""
        if self._expected is None or len(traces) <= self._expected:
            return traces
        clear = _CLEAR_PEAK_SD * min(scene.variance for scene in scenes) ** 0.5
        ranked = sorted(traces, key=lambda t: -t.spot.peak_dn)
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
        self, pair: Pair, scenes: list[PairSignal], traces: list[FittedSpot], spots: list[Spot]
    ) -> tuple[Failure, ...]:
        failures = [Failure.AMBIENT_CHANGED] if any(s.ambient_changed for s in scenes) else []
        if len(spots) < len(traces):
            failures.append(Failure.OFF_SCANLINE)
        if not spots or (self._expected is not None and len(spots) < self._expected):
            failures.append(Failure.TOO_FEW if spots else Failure.NO_SPOT)
            failures += self._reasons(pair, scenes, spots) if self._wants_reasons else []
        if self._expected is not None and len(spots) > self._expected:
            failures.append(Failure.TOO_MANY)
        if flags := NO_FLAGS.union(*(s.flags for s in spots)):
            failures += [f for f in Failure if f in flags]
        return tuple(dict.fromkeys(failures))

    def _reasons(self, pair: Pair, scenes: list[PairSignal], spots: list[Spot]) -> list[Failure]:
        """Why spots are missing: too dim, or outside the band (then the whole frame is read)."""
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


def _without(traces: list[FittedSpot], group: list[FittedSpot]) -> list[FittedSpot]:
    """The traces that are not in a group."""
    mine = {id(t) for t in group}
    return [t for t in traces if id(t) not in mine]


def _new_ones(peaks: Peaks, traces: list[FittedSpot]) -> Peaks:
    """Peaks that no measured spot explains."""
    if not traces or peaks.rows.size == 0:
        return peaks
    u = np.array([t.spot.u_px for t in traces])
    v = np.array([t.spot.v_px for t in traces])
    reach = np.array([3.0 * t.reach_px + 2.0 * peaks.scale_px for t in traces])
    apart = np.hypot(peaks.cols[:, None] - u, peaks.rows[:, None] - v)
    new = (apart > reach).all(axis=1)
    return Peaks(peaks.rows[new], peaks.cols[new], peaks.height_dn[new], peaks.scale_px)
