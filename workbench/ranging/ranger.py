"""Ranger: ranges and shapes, with their uncertainty, from spots and a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import Calibration
from workbench.model.event import LaserRange
from workbench.optics.rows import Row
from workbench.ranging.assignment import MOST_MISFIT_SD, LaserSpotPairs, assign, pair_up
from workbench.ranging.lines import LineShape, Weights, fit_line, mean_of_lines
from workbench.ranging.records import flag_notes, flat_range, laser_ranges
from workbench.ranging.shape import DEFAULT_PRIOR
from workbench.ranging.shape_prior import ShapePrior
from workbench.ranging.validity_checks import failed_checks, outside_validity
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.range_model import RangeEstimates
from workbench.spots import Scanline, Spot
from workbench.spots.search_band import band

NOTHING_SEEN = "no spot was seen"
Status = Literal["done", "not_enough_points", "no_points"]
MERGING_WIDTHS = 4.0
"""Distance of two spots, in widths, below which they may be found as one."""
SCANLINE_HALF_WIDTH_PX = 8.0
"""Half width of the search band: a beam of 1.5 mm at the sensor's front spans some 8 px on either side."""
_NONE = np.empty(0, np.intp)


@dataclass(frozen=True)
class Reading:
    """Result of ranging one scene; mm, 1 sigma."""

    scene: str
    status: Status
    closest_mm: float | None = None
    """Smallest range over the front, of the line with the smaller one."""
    sigma_mm: float | None = None
    interval_mm: tuple[float, float] | None = None
    """95 % interval over all shapes."""
    mean_mm: float | None = None
    """Mean of the closest ranges of all lines."""
    mean_sigma_mm: float | None = None
    lasers: tuple[LaserRange, ...] = ()
    """In the calibration's order."""
    lines: tuple[LineShape, ...] = ()
    """Shape in front of each row of lasers with a range, by the row's angle: horizontal first. Lasers on no
    row are in it, with an unknown shape."""
    flat_mm: float | None = None
    """Mean range of the lasers, weighted by their spots: the range of a flat target across the axis."""
    flat_sigma_mm: float | None = None
    flat_spot_sd_mm: float | None = None
    """Standard deviation of `flat_mm` by noise and speckle of the spots alone."""
    flat_at_mm: tuple[float, float] = (0.0, 0.0)
    """Mean x and y of the spots, weighted likewise: the point whose range is `flat_mm`."""
    notes: tuple[str, ...] = ()
    """Reasons of missing ranges, and remarks on uncertain ones."""

    @property
    def shapes(self) -> tuple[LineShape, ...]:
        """Shapes to report: of the rows of two lasers or more; of the nearest laser where all are single."""
        rows = tuple(line for line in self.lines if len(line.row.members) > 1)
        nearest = sorted(self.lines, key=lambda line: line.shape.closest_mm)[:1]
        return rows or tuple(nearest)


@dataclass(frozen=True)
class KnownSpots:
    """Spots of one scene whose lasers are known, because each was on alone."""

    scene: str
    fired: int
    """Number of lasers captured; with fewer ranges the status is `not_enough_points`."""
    laser_ids: Sequence[str]
    """n lasers."""
    position_px: FloatArray
    """(n, 2), NaN where a coordinate was not measured."""
    sd_px: FloatArray
    """(n, 2) 1 sigma by noise, NaN where not known."""
    speckle_sd_px: FloatArray
    """(n, 2) 1 sigma by speckle, NaN where not known."""
    notes: Sequence[str] = ()
    """Notes on the captures."""
    without_spot: Sequence[str] = ()
    """Lasers captured without a spot."""


@dataclass(frozen=True)
class Assignment:
    """Assignment of the spots of a frame with all lasers on."""

    lasers: IndexArray
    """(n,) indices of lasers with a spot."""
    spots: IndexArray
    """(n,) indices of their spots."""
    ranges: RangeEstimates
    """(n)"""
    ambiguous: tuple[str, ...]
    """Lasers without an unambiguous assignment, with or without a spot; each is to be captured alone."""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Found:
    """Spots of one scene and their ranges."""

    laser_ids: Sequence[str]
    position_px: FloatArray
    ranges: RangeEstimates
    failed: Sequence[str | None]
    """Failed validity check of each; None where the range is valid."""

    def valid(self, order: Sequence[str]) -> _Found:
        """Those with a valid range, by the order of their lasers in the calibration."""
        good = [n for n, check in enumerate(self.failed) if check is None]
        good.sort(key=lambda n: order.index(self.laser_ids[n]))
        if good == [*range(len(self.failed))]:
            return self
        index = np.array(good, np.intp)
        ids = [self.laser_ids[n] for n in good]
        return _Found(ids, self.position_px[index], self.ranges.only(index), [None] * len(good))


@dataclass(frozen=True)
class Ranger:
    """Ranger of one calibrated sensor; it needs the calibration only."""

    calibration: Calibration
    weights: Weights = "information"
    """Weights of the mean of two lines."""
    shape_prior: ShapePrior = DEFAULT_PRIOR
    """Prior over the shapes in front of a line."""

    @cached_property
    def sensor(self) -> CalibratedSensor:
        """The calibration as arrays."""
        return CalibratedSensor(self.calibration)

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) of frames."""
        return self.calibration.image_width, self.calibration.image_height

    @cached_property
    def scanlines(self) -> tuple[Scanline, ...]:
        """Image line along which the spot of each laser moves with range."""
        nearest, _ = self.calibration.laser_ranger.validity.standoff_mm
        return tuple(self._scanline(i, nearest) for i in self.sensor.ids)

    @property
    def speckle_sd_px(self) -> float:
        """Deviation of a spot by speckle, for the search."""
        return self.calibration.laser_ranger.noise.speckle_sd_px

    def searched(self, laser_ids: Sequence[str]) -> list[Scanline]:
        """Search bands for lasers that are on together, one for each row of lasers.

        The scanlines of one row nearly coincide, or lie side by side; searching each would repeat work.
        """
        rows = ([i for i in laser_ids if i in names] for names in self._members)
        return [
            self._fields[own[0]] if len(own) == 1 else band([self._fields[i] for i in own])
            for own in rows
            if own
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
    def _members(self) -> tuple[frozenset[str], ...]:
        """Ids of the lasers of each row of the sensor."""
        return tuple(frozenset(self.sensor.ids[i] for i in row.members) for row in self.sensor.rows)

    def read_known(
        self,
        scene: str,
        fired: int,
        laser_ids: Sequence[str],
        position_px: FloatArray,
        sd_px: FloatArray,
        notes: Sequence[str] = (),
        without_spot: Sequence[str] = (),
        speckle_sd_px: FloatArray | None = None,
    ) -> Reading:
        """Range the spots of one scene whose lasers are known; arguments as in `KnownSpots`.

        `speckle_sd_px` None: known nowhere.
        """
        speckle = np.full((len(laser_ids), 2), np.nan) if speckle_sd_px is None else speckle_sd_px
        spots = KnownSpots(scene, fired, laser_ids, position_px, sd_px, speckle, notes, without_spot)
        (reading,) = self.read_scenes([spots])
        return reading

    def read_scenes(self, scenes: Sequence[KnownSpots]) -> list[Reading]:
        """One reading for each scene; the spots of all scenes are ranged together, which saves time."""
        if not scenes:
            return []
        ids = [i for scene in scenes for i in scene.laser_ids]
        position, sd, speckle_sd = (
            np.concatenate(parts)
            for parts in zip(*((s.position_px, s.sd_px, s.speckle_sd_px) for s in scenes), strict=True)
        )
        ranges = self.sensor.ranges(ids, position, sd, speckle_sd)
        failed = failed_checks(position, ranges, self.size_px)
        readings, end = [], 0
        for scene in scenes:
            own = slice(end, end := end + len(scene.laser_ids))
            found = _Found(scene.laser_ids, position[own], ranges.only(own), failed[own])
            readings.append(self._answer(scene.scene, scene.fired, found, scene.notes, scene.without_spot))
        return readings

    def read_lit(self, scene: str, spots: Sequence[Spot]) -> Reading:
        """Range the spots of a frame with all lasers on.

        Rows of lasers with an ambiguous assignment have no range: capture these lasers one by one instead.
        """
        return self.read_assigned(scene, spots, self.assign_spots(spots))

    def read_assigned(self, scene: str, spots: Sequence[Spot], assignment: Assignment) -> Reading:
        """Range spots that are assigned to their lasers."""
        if not spots:
            return Reading(scene, "no_points", notes=(NOTHING_SEEN,))
        ids = [self.sensor.ids[i] for i in assignment.lasers]
        assigned = [spots[i] for i in assignment.spots.tolist()]
        position = positions(assigned)
        notes = (*assignment.notes, *flag_notes(ids, assigned))
        without_spot = [i for i in self.sensor.ids if i not in ids and i not in assignment.ambiguous]
        failed = failed_checks(position, assignment.ranges, self.size_px)
        found = _Found(ids, position, assignment.ranges, failed)
        reading = self._answer(scene, len(self.sensor.ids), found, notes, without_spot)
        if assignment.ambiguous and reading.status == "no_points":
            return Reading(scene, "not_enough_points", notes=reading.notes)
        return reading

    def assign_spots(self, spots: Sequence[Spot]) -> Assignment:
        """Assign the spots of a frame with all lasers on, each row of lasers independently.

        Two rows that claim the same spot are both ambiguous. Where the spot of a laser without one would lie
        on a spot of another laser, both lasers are ambiguous: the spot may be the sum of two.
        """
        pairs = pair_up(self.sensor, *spot_arrays(spots))
        rows = self.sensor.rows
        found = [assign(pairs, row.lasers) for row in rows]
        claimed = [n for f in found if f is not None for n in f[1].tolist()]
        twice = {n for n in claimed if claimed.count(n) > 1}
        clear = [None if f is None or not twice.isdisjoint(f[1].tolist()) else f for f in found]
        lasers, assigned = (
            np.concatenate([_NONE, *(f[of] for f in clear if f is not None)]) for of in range(2)
        )
        hidden = [
            pair
            for row, f in zip(rows, clear, strict=True)
            if f is not None
            for pair in self._hidden(spots, pairs, *f, row.lasers)
        ]
        unclear = [row for row, f in zip(rows, clear, strict=True) if f is None]
        ambiguous = {int(i) for row in unclear for i in row.lasers}
        if hidden:
            single = ~np.isin(assigned, [spot for _, spot in hidden])
            ambiguous |= {laser for laser, _ in hidden} | set(lasers[~single].tolist())
            lasers, assigned = lasers[single], assigned[single]
        notes = self._assignment_notes(pairs, len(spots), unclear)
        notes += tuple(
            f"{self.sensor.ids[laser]}: its spot may be merged with that at u = {spots[spot].u_px:.0f},"
            f" v = {spots[spot].v_px:.0f} px: capture each laser alone"
            for laser, spot in hidden
        )
        ids = tuple(i for n, i in enumerate(self.sensor.ids) if n in ambiguous)
        return Assignment(lasers, assigned, pairs.chosen(lasers, assigned), ids, notes)

    def _hidden(
        self,
        spots: Sequence[Spot],
        pairs: LaserSpotPairs,
        seen: IndexArray,
        assigned: IndexArray,
        lasers: IndexArray,
    ) -> list[tuple[int, int]]:
        """Lasers of a row without a spot, each with a spot that its own would merge with.

        The expected spots are those at the ranges of the row's other lasers.

        Args:
            spots: all spots.
            pairs: all pairs of lasers and spots.
            seen: (n,) lasers of the row with a spot.
            assigned: (n,) their spots.
            lasers: all lasers of the row.
        """
        if len(seen) in (0, len(lasers)):
            return []
        range_mm = pairs.chosen(seen, assigned).range_mm
        range_mm = range_mm[np.isfinite(range_mm)]
        position = positions(spots)
        near_px = MERGING_WIDTHS * np.array([spot.width_px for spot in spots])
        hidden = []
        for laser in sorted(set(lasers.tolist()).difference(seen.tolist())):
            expected = self.sensor.spot_px(self.sensor.ids[laser], range_mm)
            distance_px = np.hypot(*(expected[:, None] - position).T).min(axis=1, initial=np.inf)
            hidden += [(laser, int(n)) for n in np.flatnonzero(distance_px < near_px)]
        return hidden

    def _assignment_notes(
        self, pairs: LaserSpotPairs, spots: int, ambiguous: Sequence[Row]
    ) -> tuple[str, ...]:
        """Notes on spots off all lines, ambiguous rows, and too many spots."""
        other = int((pairs.misfit_sd >= MOST_MISFIT_SD).all(axis=0).sum())
        notes = [f"{other} of {spots} spots on no laser's line: other light"] if other else []
        if ambiguous:
            lines = " and ".join(f"{len(row.members)} {row.name}" for row in ambiguous)
            seen = f"{spots} spot{'s' * (spots != 1)}"
            notes.append(f"ambiguous assignment of {seen} to {lines} lasers: capture each laser alone")
        if spots - other > len(self.sensor.ids):
            notes.append("more spots than lasers: check that this is the calibration of this sensor")
        return tuple(notes)

    def _answer(
        self, scene: str, fired: int, found: _Found, notes: Sequence[str], without_spot: Sequence[str]
    ) -> Reading:
        named = zip(found.laser_ids, found.failed, strict=True)
        all_notes = [*notes, *(f"{i}: {check}" for i, check in named if check is not None)]
        valid = found.valid(self.sensor.ids)
        if not valid.laser_ids:
            return Reading(scene, "no_points", notes=tuple(all_notes) or (NOTHING_SEEN,))
        ids, ranges = valid.laser_ids, valid.ranges
        lasers = laser_ranges(ids, valid.position_px, ranges, self.sensor.offset_mm)
        status: Status = "done" if len(lasers) == fired else "not_enough_points"
        flat_mm, flat_sigma_mm, flat_spot_sd_mm = flat_range(ranges)
        lines = self._lines(ids, ranges)
        nearest = min((line.shape for line in lines), key=lambda shape: shape.closest_mm)
        all_notes += [self._no_spot_note(i, flat_mm) for i in without_spot]
        all_notes += outside_validity(lasers, self.calibration.laser_ranger.validity, self._calibrated_px)
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
            flat_spot_sd_mm,
            self._mean_place(ids, ranges),
            tuple(all_notes),
        )

    def _mean_place(self, ids: Sequence[str], ranges: RangeEstimates) -> tuple[float, float]:
        weight = ranges.spot_sd_mm**-2
        x, y = (self.sensor.positions_mm(ids, ranges.range_mm) @ weight / weight.sum()).tolist()
        return x, y

    def _no_spot_note(self, laser_id: str, range_mm: float) -> str:
        if self.sensor.in_frame(laser_id, np.array([range_mm]))[0]:
            return f"{laser_id}: no spot was seen"
        return f"{laser_id}: at {range_mm:.0f} mm its spot lies outside the image"

    def _lines(self, ids: Sequence[str], ranges: RangeEstimates) -> tuple[LineShape, ...]:
        lines = []
        for row, names in zip(self.sensor.rows, self._members, strict=True):
            if own := [n for n, i in enumerate(ids) if i in names]:
                lines.append(fit_line(self.sensor, row, ids, ranges, own, self.shape_prior))
        return tuple(lines)

    def _scanline(self, laser_id: str, nearest_mm: float) -> Scanline:
        near, far = self.sensor.spot_px(laser_id, np.array([nearest_mm, np.inf]))
        du, dv = near - far
        bend = self.sensor.bend_px(laser_id, nearest_mm, far, near - far)
        return Scanline(far[0], far[1], du, dv, SCANLINE_HALF_WIDTH_PX + bend)


def positions(spots: Sequence[Spot]) -> FloatArray:
    """(n, 2) u, v of spots."""
    return np.array([(s.u_px, s.v_px) for s in spots]).reshape(-1, 2)


def spot_arrays(spots: Sequence[Spot]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n, 2) positions, standard deviations by noise, and by speckle (NaN: not known)."""
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in spots]).reshape(-1, 2)
    speckle_sd = np.array([(s.u_speckle_sd_px, s.v_speckle_sd_px) for s in spots], float).reshape(-1, 2)
    return positions(spots), sd, speckle_sd
