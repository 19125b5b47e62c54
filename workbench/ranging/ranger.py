"""The ranger: spots and a calibration in, ranges and shapes with their uncertainty out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import Calibration
from workbench.model.event import LaserRange
from workbench.ranging.assignment import MOST_MISFIT_SD, Pairs, assign, pair_up
from workbench.ranging.lines import NAMES, Axis, Line, Weights, line_of, mean_of_lines
from workbench.ranging.records import flag_notes, flat_range, laser_ranges
from workbench.ranging.search_band import band
from workbench.ranging.validity_checks import objections, outside_validity
from workbench.sensor.calibrated import CalibratedSensor, RangeEstimates
from workbench.spots import Scanline, Spot

NOTHING_SEEN = "no spot was seen"
Status = Literal["done", "not_enough_points", "no_points"]
MERGING_WIDTHS = 4.0
"""Spots nearer than this to each other may be found as one."""
SCANLINE_HALF_WIDTH_PX = 8.0
"""A beam of 1.5 mm at the sensor's front spreads over some 8 px on either side of its line."""


@dataclass(frozen=True)
class Reading:
    """The ranger's answer to one scene; mm, 1 sigma."""

    scene: str
    status: Status
    closest_mm: float | None = None
    """Smallest range over the front, by the shapes before the lines."""
    sigma_mm: float | None = None
    interval_mm: tuple[float, float] | None = None
    """95 %, if the shape is the one told."""
    mean_mm: float | None = None
    """Mean of the closest ranges of the lines; that of the only one where there is one."""
    mean_sigma_mm: float | None = None
    lasers: tuple[LaserRange, ...] = ()
    """In the calibration's order."""
    lines: tuple[Line, ...] = ()
    """The shape before each line of lasers that has a range; horizontal first."""
    flat_mm: float | None = None
    """Mean range of the lasers, weighted by their spots: the range of a flat target across the axis."""
    flat_sigma_mm: float | None = None
    notes: tuple[str, ...] = ()
    """Why lasers have no range, and which ranges to take with care."""


@dataclass(frozen=True)
class Assignment:
    """The spots of a frame in which every laser is lit, as far as they tell their lasers."""

    lasers: IndexArray
    """(n,) indices of lasers with a spot."""
    spots: IndexArray
    """(n,) indices of their spots."""
    ranges: RangeEstimates
    """(n)"""
    ambiguous: tuple[str, ...]
    """Lasers whose spots, if they have any, cannot be told apart: fire each alone."""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ranger:
    """Consumes a calibration, and nothing else."""

    calibration: Calibration
    weights: Weights = "information"
    """How the ranges of two lines are averaged."""

    @cached_property
    def sensor(self) -> CalibratedSensor:
        """The calibration as arrays."""
        return CalibratedSensor(self.calibration)

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) that frames must have."""
        return self.calibration.image_width, self.calibration.image_height

    @cached_property
    def scanlines(self) -> tuple[Scanline, ...]:
        """The line in the image along which each laser's spot moves with range."""
        nearest, _ = self.calibration.laser_ranger.validity.standoff_mm
        return tuple(self._scanline(i, nearest) for i in self.sensor.ids)

    def searched(self, laser_ids: Sequence[str]) -> list[Scanline]:
        """Where the spots of lasers that are lit together may lie: one band for each line of lasers.

        The lines of lasers side by side all but coincide; to search each by itself would be the same work
        several times over.
        """
        if len(laser_ids) == 1:
            return [self._fields[laser_ids[0]]]
        return [
            band([self._fields[i] for i in mine], axis)
            for axis, lasers in self._axes.items()
            if (mine := [i for i in laser_ids if self.sensor.ids.index(i) in lasers])
        ]

    @cached_property
    def _fields(self) -> dict[str, Scanline]:
        return dict(zip(self.sensor.ids, self.scanlines, strict=True))

    @cached_property
    def _calibrated_px(self) -> dict[str, FloatArray]:
        """(2, 2) u, v of each laser's spot at the nearest and the farthest standoff of the calibration."""
        ends = np.array(self.calibration.laser_ranger.validity.standoff_mm)
        return {i: self.sensor.spot_px(i, ends) for i in self.sensor.ids}

    @cached_property
    def _axes(self) -> dict[Axis, IndexArray]:
        """The lasers of each line that there is."""
        axes: tuple[Axis, ...] = ("u", "v")
        return {axis: lasers for axis in axes if len(lasers := self.sensor.lasers_on(axis))}

    def read_known(
        self,
        scene: str,
        fired: int,
        laser_ids: Sequence[str],
        position_px: FloatArray,
        sd_px: FloatArray,
        notes: Sequence[str] = (),
        unseen: Sequence[str] = (),
    ) -> Reading:
        """Range spots whose lasers are known, because each was fired alone.

        Args:
            scene: name of the scene.
            fired: how many lasers were fired; fewer spots make the status `not_enough_points`.
            laser_ids: n lasers.
            position_px: (n, 2), NaN where a coordinate was not measured.
            sd_px: (n, 2) 1 sigma, NaN where not known.
            notes: what is to be said of the captures.
            unseen: lasers that were fired and made no spot.
        """
        ranges = self.sensor.ranges(laser_ids, position_px, sd_px)
        return self._answer(scene, fired, laser_ids, position_px, ranges, notes, unseen)

    def read_lit(self, scene: str, spots: Sequence[Spot]) -> Reading:
        """Range the spots of a frame in which every laser is lit.

        Lines of lasers whose spots cannot be told apart have no range: fire these lasers alone instead.
        """
        return self.read_assigned(scene, spots, self.assign_spots(spots))

    def read_assigned(self, scene: str, spots: Sequence[Spot], dealt: Assignment) -> Reading:
        """Range spots that have been dealt to their lasers."""
        if not spots:
            return Reading(scene, "no_points", notes=(NOTHING_SEEN,))
        ids = [self.sensor.ids[i] for i in dealt.lasers]
        mine = [spots[i] for i in dealt.spots.tolist()]
        position, _ = spot_arrays(mine)
        notes = (*dealt.notes, *flag_notes(ids, mine))
        unseen = [i for i in self.sensor.ids if i not in ids and i not in dealt.ambiguous]
        reading = self._answer(scene, len(self.sensor.ids), ids, position, dealt.ranges, notes, unseen)
        if dealt.ambiguous and reading.status == "no_points":
            return Reading(scene, "not_enough_points", notes=reading.notes)
        return reading

    def assign_spots(self, spots: Sequence[Spot]) -> Assignment:
        """Deal the spots of a frame in which every laser is lit to the lasers, each line apart.

        A spot that two lines claim leaves both untold. A laser without a spot whose spot would lie where
        another is leaves both of these untold: what is seen there may be the sum of the two.
        """
        pairs = pair_up(self.sensor, *spot_arrays(spots))
        found = {axis: assign(pairs, lasers) for axis, lasers in self._axes.items()}
        claimed = np.concatenate([np.empty(0, np.intp), *(f[1] for f in found.values() if f is not None)])
        twice = {i for i in claimed if (claimed == i).sum() > 1}
        told = {axis: f for axis, f in found.items() if f is not None and twice.isdisjoint(f[1].tolist())}
        lasers = np.concatenate([np.empty(0, np.intp), *(f[0] for f in told.values())])
        dealt = np.concatenate([np.empty(0, np.intp), *(f[1] for f in told.values())])
        hidden = [pair for axis in told for pair in self._hidden(spots, pairs, *told[axis], self._axes[axis])]
        clear = ~np.isin(dealt, [spot for _, spot in hidden])
        ambiguous = {int(i) for axis, all_ in self._axes.items() if axis not in told for i in all_}
        ambiguous |= {laser for laser, _ in hidden} | set(lasers[~clear].tolist())
        notes = self._what_is_left(pairs, len(spots), tuple(axis for axis in self._axes if axis not in told))
        notes += tuple(
            f"{self.sensor.ids[laser]}: its spot may be one with that at u = {spots[spot].u_px:.0f},"
            f" v = {spots[spot].v_px:.0f} px: fire each laser alone"
            for laser, spot in hidden
        )
        ids = tuple(i for n, i in enumerate(self.sensor.ids) if n in ambiguous)
        lasers, dealt = lasers[clear], dealt[clear]
        return Assignment(lasers, dealt, pairs.chosen(lasers, dealt), ids, notes)

    def _hidden(
        self, spots: Sequence[Spot], pairs: Pairs, told: IndexArray, dealt: IndexArray, lasers: IndexArray
    ) -> list[tuple[int, int]]:
        """Lasers of a line without a spot, each with a spot that its own would lie on at a depth told."""
        if len(told) in (0, len(lasers)):
            return []
        depth_mm = pairs.chosen(told, dealt).range_mm
        depth_mm = depth_mm[np.isfinite(depth_mm)]
        place, _ = spot_arrays(spots)
        near_px = MERGING_WIDTHS * np.array([spot.width_px for spot in spots])
        hidden = []
        for laser in np.setdiff1d(lasers, told).tolist():
            expected = self.sensor.spot_px(self.sensor.ids[laser], depth_mm)
            apart_px = np.hypot(*(expected[:, None] - place).T).min(axis=1, initial=np.inf)
            hidden += [(laser, int(n)) for n in np.flatnonzero(apart_px < near_px)]
        return hidden

    def alone(self, laser_id: str, spots: Sequence[Spot]) -> list[Spot]:
        """The spots on the line of a laser that was fired alone; its own is known if there is one only."""
        position, sd = spot_arrays(spots)
        ranges = self.sensor.ranges([laser_id] * len(spots), position, sd)
        possible = (ranges.range_mm > 0) & np.isfinite(ranges.range_mm)  # not beyond infinity
        on_line = np.flatnonzero((ranges.misfit_sd < MOST_MISFIT_SD) & possible)
        return [spots[n] for n in on_line.tolist()]

    def _what_is_left(self, pairs: Pairs, spots: int, ambiguous: tuple[Axis, ...]) -> tuple[str, ...]:
        astray = int((pairs.misfit_sd >= MOST_MISFIT_SD).all(axis=0).sum())
        notes = [f"{astray} of {spots} spots on no laser's line: other light"] if astray else []
        if ambiguous:
            lines = " and ".join(f"{len(self._axes[axis])} {NAMES[axis]}" for axis in ambiguous)
            seen = f"{spots} spot{'s' * (spots != 1)}"
            notes.append(f"{seen} of {lines} lasers cannot be told apart: fire each laser alone")
        if spots - astray > len(self.sensor.ids):
            notes.append("more spots than lasers: is this the calibration of this sensor?")
        return tuple(notes)

    def _answer(
        self,
        scene: str,
        fired: int,
        laser_ids: Sequence[str],
        position_px: FloatArray,
        ranges: RangeEstimates,
        notes: Sequence[str],
        unseen: Sequence[str],
    ) -> Reading:
        against = objections(position_px, ranges, self.size_px)
        said = [
            *notes,
            *(f"{i}: {why}" for i, why in zip(laser_ids, against, strict=True) if why is not None),
        ]
        good = [n for n, why in enumerate(against) if why is None]
        if not good:
            return Reading(scene, "no_points", notes=tuple(said) or (NOTHING_SEEN,))
        good.sort(key=lambda n: self.sensor.ids.index(laser_ids[n]))
        ids, position = [laser_ids[n] for n in good], position_px[good]
        ranges = ranges.only(np.array(good))
        lasers = laser_ranges(ids, position, ranges, self.sensor.offset_mm)
        status: Status = "done" if len(lasers) == fired else "not_enough_points"
        flat_mm, flat_sigma_mm = flat_range(ranges)
        lines = self._lines(ids, ranges)
        nearest = min((line.shape for line in lines), key=lambda shape: shape.closest_mm)
        said += [self._why_unseen(i, flat_mm) for i in unseen]
        said += outside_validity(lasers, self.calibration.laser_ranger.validity, self._calibrated_px)
        return Reading(
            scene,
            status,
            nearest.closest_mm,
            nearest.closest_sigma_mm,
            nearest.closest_interval_mm,
            *mean_of_lines(lines, self.sensor.covariance, self.weights, self.size_px),
            lasers,
            lines,
            flat_mm,
            flat_sigma_mm,
            tuple(said),
        )

    def _why_unseen(self, laser_id: str, range_mm: float) -> str:
        if self.sensor.in_frame(laser_id, np.array([range_mm]))[0]:
            return f"{laser_id}: no spot was seen"
        return f"{laser_id}: at {range_mm:.0f} mm its spot lies outside the picture"

    def _lines(self, ids: Sequence[str], ranges: RangeEstimates) -> tuple[Line, ...]:
        lines = []
        for axis, lasers in self._axes.items():
            names = {self.sensor.ids[i] for i in lasers}
            if mine := [n for n, i in enumerate(ids) if i in names]:
                lines.append(line_of(self.sensor, axis, ids, ranges, mine))
        return tuple(lines)

    def _scanline(self, laser_id: str, nearest_mm: float) -> Scanline:
        near, far = self.sensor.spot_px(laser_id, np.array([nearest_mm, np.inf]))
        du, dv = near - far
        bend = self.sensor.bend_px(laser_id, nearest_mm, far, near - far)
        return Scanline(far[0], far[1], du, dv, SCANLINE_HALF_WIDTH_PX + bend)


def spot_arrays(spots: Sequence[Spot]) -> tuple[FloatArray, FloatArray]:
    """(n, 2) positions and (n, 2) standard deviations."""
    position = np.array([(s.u_px, s.v_px) for s in spots]).reshape(-1, 2)
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in spots]).reshape(-1, 2)
    return position, sd
