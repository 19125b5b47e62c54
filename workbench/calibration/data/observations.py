"""Single observations of spots, and their means for each laser and placement, which the fit uses.

A cell is one laser at one placement.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isnan
from operator import attrgetter

import numpy as np

from workbench.calibration.data.averaging import (
    is_inconsistent,
    outliers,
    outliers_of_few,
    scatter_chi2,
    usual_scale,
    weighted_mean,
)
from workbench.calibration.data.capture_times import NO_TIMES, CaptureTimes
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.rig import NoiseSpec


@dataclass(frozen=True)
class Observation:
    """One laser's spot in one capture, of a target at a known standoff. NaN: not measured or not stated."""

    source: str
    """Origin for messages: `row 3`, or a capture's key."""
    laser_id: str
    placement: str
    """Observations with the same placement share the error of its standoff."""
    standoff_mm: float
    repeat: int
    u_px: float
    v_px: float
    u_sd_px: float = float("nan")
    v_sd_px: float = float("nan")
    standoff_sd_mm: float = float("nan")
    yaw_deg: float = 0.0
    """Commanded tilt of the target about the vertical."""
    saturated: bool = False
    """The middle of the spot was clipped."""
    u_speckle_sd_px: float = float("nan")
    """1 sigma by speckle, which the repeats share; `u_sd_px` does not include it."""
    v_speckle_sd_px: float = float("nan")
    time_s: float = float("nan")
    """Time of the capture, from any zero."""
    part: str = ""
    """Name of the uninterrupted part of the session."""

    @property
    def seen(self) -> bool:
        """Whether a spot was found: at least one coordinate is measured."""
        return not (isnan(self.u_px) and isnan(self.v_px))


POSITION = attrgetter("u_px", "v_px")
SD = attrgetter("u_sd_px", "v_sd_px")
SPECKLE_SD = attrgetter("u_speckle_sd_px", "v_speckle_sd_px")


@dataclass(frozen=True)
class RejectedObservation(Rejected):
    """A rejected capture of one laser at a known standoff."""

    observation: Observation
    """Without a position (`seen` is false) where no spot was found; else an outlier."""


@dataclass(frozen=True)
class PlacementInfo:
    """One placement of the target, by the captures that state it."""

    key: str
    standoff_mm: float
    """NaN: a view of a board held anywhere."""
    standoff_sd_mm: float
    """NaN: not stated, the rig's is used."""
    yaw_deg: float
    source: str = ""
    """The first observation of the placement."""

    @classmethod
    def of(cls, s: Observation) -> PlacementInfo:
        """The placement as one observation states it."""
        return cls(s.placement, s.standoff_mm, s.standoff_sd_mm, s.yaw_deg, s.source)

    @property
    def is_free(self) -> bool:
        """Whether no standoff is stated: the corners alone determine the pose of the board."""
        return isnan(self.standoff_mm)

    @property
    def setting(self) -> tuple[float | None, float | None, float]:
        """Standoff, its sd (None: not stated) and yaw: equal for all observations of a placement."""
        standoff_mm = None if self.is_free else self.standoff_mm
        return standoff_mm, None if isnan(self.standoff_sd_mm) else self.standoff_sd_mm, self.yaw_deg

    @property
    def describe(self) -> str:
        """Text for messages."""
        if self.is_free:
            return "no standoff"
        sd = "" if isnan(self.standoff_sd_mm) else f" +- {self.standoff_sd_mm:g}"
        return f"{self.standoff_mm:g}{sd} mm, {self.yaw_deg:g} deg"


@dataclass(frozen=True)
class MeanObservations:
    """Mean positions of N cells with spots; arrays of length N.

    The mean of the repeats and its standard deviation are sufficient statistics for the fit: its model
    predicts the same position for all repeats.
    """

    placements: tuple[PlacementInfo, ...]
    laser: IndexArray
    placement: IndexArray
    position_px: FloatArray
    """(N, 2) u, v; NaN where a coordinate was not measured."""
    sd_px: FloatArray
    """(N, 2) 1 sigma of the mean, including the error that the repeats share (speckle)."""
    speckle_sd_px: FloatArray
    """(N, 2) 1 sigma of that shared error."""
    time: FloatArray
    """(N,) mean running time of the repeats: -0.5 first capture of the session, 0.5 last."""
    parts: FloatArray
    """(N, P) share of the repeats in each part of the session."""
    members: tuple[tuple[Observation, ...], ...]
    """The observations that each mean is taken over."""
    repeat_scale: float = 1.0
    """Factor on the stated deviations, estimated from the scatter of the repeats; 1 where they agree."""
    repeat_freedom: float = 0.0
    """Degrees of freedom of that scatter."""
    captures: tuple[Observation, ...] = ()
    """Every observation in the order of the captures, outliers included."""
    inconsistent: tuple[int, ...] = ()
    """Cells whose repeats scatter far more than those of all others; their sd is that of the scatter."""
    times: CaptureTimes = NO_TIMES
    """Of `captures`."""


def group(
    observations: Iterable[Observation], laser_ids: Sequence[str], noise: NoiseSpec
) -> tuple[MeanObservations, list[Rejected]]:
    """Average the repeats of each laser at each placement; reject outliers among the repeats.

    Where the repeats scatter significantly more than their stated deviations, all deviations are scaled to
    the scatter (`MeanObservations.repeat_scale`). Where the repeats of a single cell do
    (`MeanObservations.inconsistent`), that cell's deviation alone is scaled.

    Raises:
        BadInputError: observations of one placement state different standoffs, deviations or tilts.
    """
    buckets: dict[tuple[str, str], list[Observation]] = defaultdict(list)
    placements: dict[str, PlacementInfo] = {}
    seen = list(observations)
    settings = set[tuple[str, float, float, float]]()
    for s in seen:
        buckets[s.placement, s.laser_id].append(s)
        setting = s.placement, s.standoff_mm, s.standoff_sd_mm, s.yaw_deg
        if setting not in settings:
            settings.add(setting)
            _check_placement(placements.setdefault(s.placement, PlacementInfo.of(s)), s)
    kept: dict[tuple[str, str], list[Observation]] = {}
    rejected: list[Rejected] = []
    # Read once: there may be a hundred thousand.
    measured = {key: (positions(members), stated_sd(members, noise)) for key, members in buckets.items()}
    usual = usual_scale([scatter_chi2(*one) for one in measured.values()])
    for key, members in buckets.items():
        position, sd = measured.pop(key)
        outlying, dropped = _outliers(members, position, sd, usual)
        rejected += dropped
        if not outlying.all():  # repeats may lie apart one in u and the next in v: then none is left
            kept[key] = [s for s, out in zip(members, outlying.tolist(), strict=True) if not out]
            measured[key] = position[~outlying], sd[~outlying]
    scatter = [scatter_chi2(*one) for one in measured.values()]
    inconsistent = [n for n, one in enumerate(scatter) if is_inconsistent(one, usual)]
    alike = [one for n, one in enumerate(scatter) if n not in inconsistent]
    freedom = sum(free for _, free in alike)
    scale = float(significant_scale(sum(chi2 for chi2, _ in alike), freedom))
    scales = [(chi2 / free) ** 0.5 if n in inconsistent else scale for n, (chi2, free) in enumerate(scatter)]
    means = [
        weighted_mean(position, own * sd)
        for (position, sd), own in zip(measured.values(), scales, strict=True)
    ]
    speckle_sd = [np.sqrt((stated_speckle_sd(m, noise) ** 2).mean(axis=0)) for m in kept.values()]
    times = CaptureTimes.of(np.array([s.time_s for s in seen]), [s.part for s in seen])
    time, parts = _mean_times(seen, times, list(kept.values()))
    seen_at = {placement for placement, _ in kept}
    order = [key for key in placements if key in seen_at]
    return (
        MeanObservations(
            placements=tuple(placements[key] for key in order),
            laser=np.array([laser_ids.index(laser) for _, laser in kept], dtype=np.intp),
            placement=np.array([order.index(placement) for placement, _ in kept], dtype=np.intp),
            position_px=np.array([mean for mean, _ in means]).reshape(-1, 2),
            sd_px=np.hypot([sd for _, sd in means], speckle_sd).reshape(-1, 2),
            speckle_sd_px=np.reshape(speckle_sd, (-1, 2)),
            time=time,
            parts=parts,
            members=tuple(tuple(m) for m in kept.values()),
            repeat_scale=scale,
            repeat_freedom=freedom,
            captures=tuple(seen),
            inconsistent=tuple(inconsistent),
            times=times,
        ),
        rejected,
    )


def _mean_times(
    captured: Sequence[Observation], times: CaptureTimes, cells: Sequence[Sequence[Observation]]
) -> tuple[FloatArray, FloatArray]:
    """`MeanObservations.time` and `MeanObservations.parts` of N cells."""
    number = {id(s): n for n, s in enumerate(captured)}
    own = [[number[id(s)] for s in members] for members in cells]
    shares = np.eye(max(len(times.limits), 1))[times.part]
    return (
        np.array([np.mean(times.time[one]) for one in own]),
        np.array([np.mean(shares[one], axis=0) for one in own]).reshape(-1, shares.shape[1]),
    )


def as_grid(cells: MeanObservations, lasers: int) -> tuple[FloatArray, FloatArray]:
    """(J, L, 2) mean positions of one calibration and their standard deviations, NaN where not seen."""
    shape = (len(cells.placements), lasers, 2)
    position, sd = np.full(shape, np.nan), np.full(shape, np.nan)
    position[cells.placement, cells.laser] = cells.position_px
    sd[cells.placement, cells.laser] = cells.sd_px
    return position, sd


def positions(observations: Sequence[Observation]) -> FloatArray:
    """(n, 2) measured u, v."""
    return _pairs(observations, POSITION)


def stated_sd(observations: Sequence[Observation], noise: NoiseSpec) -> FloatArray:
    """(n, 2) standard deviation of each position, the rig's where the observation states none."""
    sd = _pairs(observations, SD)
    return np.where(np.isfinite(sd), sd, noise.spot_sd_px)


def stated_speckle_sd(observations: Sequence[Observation], noise: NoiseSpec) -> FloatArray:
    """(n, 2) standard deviation by speckle, the rig's where the observation states none."""
    sd = _pairs(observations, SPECKLE_SD)
    return np.where(np.isfinite(sd), sd, noise.speckle_sd_px)


def _pairs(
    observations: Sequence[Observation], of: Callable[[Observation], tuple[float, float]]
) -> FloatArray:
    """(n, 2) two numbers of each observation, of which there may be a hundred thousand."""
    return np.fromiter(chain.from_iterable(map(of, observations)), float, 2 * len(observations)).reshape(
        -1, 2
    )


def _check_placement(first: PlacementInfo, observation: Observation) -> None:
    other = PlacementInfo.of(observation)
    if other.setting != first.setting:
        raise BadInputError(
            f"{observation.source}: standoff_mm: placement {first.key}: expected {first.describe} as in"
            f" {first.source}, got {other.describe}; give each placement its own name"
        )


def _outliers(
    members: Sequence[Observation], position: FloatArray, sd: FloatArray, usual: float
) -> tuple[BoolArray, list[Rejected]]:
    """(n,) outliers among the repeats of one cell, and each with its distance from the median."""
    outlying = outliers(position, sd) | outliers_of_few(position, usual * sd)
    median = np.nanmedian(position, axis=0) if outlying.any() else np.zeros(2)
    dropped: list[Rejected] = [
        RejectedObservation(
            members[n].source,
            f"laser {members[n].laser_id} at {members[n].standoff_mm:g} mm:"
            f" {np.nanmax(np.abs(position[n] - median)):.2f} px from the median of its repeats",
            members[n],
        )
        for n in np.flatnonzero(outlying).tolist()
    ]
    return outlying, dropped
