"""Single observations of spots, and their means for each laser and placement, which the fit uses."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np

from workbench.calibration.data.averaging import (
    is_torn,
    scatter_chi2,
    strays,
    strays_of_few,
    usual_scale,
    weighted_mean,
)
from workbench.calibration.estimation.noise_scale import scale_called_for
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.errors import BadInputError
from workbench.model.rig import NoiseSpec


@dataclass(frozen=True)
class Observation:
    """One laser's spot in one capture, of a target at a known standoff. NaN: not measured or not stated."""

    source: str
    """Where it comes from, for people: `row 3`, or a capture's key."""
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
    """Tilt of the target about the vertical, as it was set."""
    saturated: bool = False
    """The middle of the spot was clipped."""


@dataclass(frozen=True)
class Rejected:
    """A observation or row that the fit did not use."""

    source: str
    reason: str
    missing: Observation | None = None
    """Where a spot was expected and none was seen: its laser and standoff."""
    stray: Observation | None = None
    """What was seen, where it was left out for lying apart from the other repeats."""


@dataclass(frozen=True)
class PlacementInfo:
    """One placing of the target, as the ruler and the technician tell it."""

    key: str
    standoff_mm: float
    standoff_sd_mm: float
    """NaN when not stated: the rig's is used."""
    yaw_deg: float
    source: str = ""
    """Who said so first."""

    @classmethod
    def of(cls, s: Observation) -> PlacementInfo:
        """What a observation says of its placement."""
        return cls(s.placement, s.standoff_mm, s.standoff_sd_mm, s.yaw_deg, s.source)

    @property
    def told(self) -> tuple[float, float | None, float]:
        """What must be the same for all observations of a placement."""
        return self.standoff_mm, None if isnan(self.standoff_sd_mm) else self.standoff_sd_mm, self.yaw_deg

    @property
    def describe(self) -> str:
        """For people."""
        sd = "" if isnan(self.standoff_sd_mm) else f" +- {self.standoff_sd_mm:g}"
        return f"{self.standoff_mm:g}{sd} mm, {self.yaw_deg:g} deg"


@dataclass(frozen=True)
class MeanObservations:
    """Mean positions, one for each laser and placement that was seen; arrays of length N.

    The mean of the repeats and its standard deviation are sufficient for the fit: nothing that the fit can
    explain differs between repeats.
    """

    placements: tuple[PlacementInfo, ...]
    laser: IndexArray
    placement: IndexArray
    position_px: FloatArray
    """(N, 2) u, v; NaN where a coordinate was not measured."""
    sd_px: FloatArray
    """(N, 2) 1 sigma of the mean, shared error of the repeats included."""
    time: FloatArray
    """(N,) mean place of the repeats in the order of capture: -0.5 first of the session, 0.5 last."""
    members: tuple[tuple[Observation, ...], ...]
    """The observations behind each mean."""
    repeat_scale: float = 1.0
    """Factor on the stated deviations that the scatter of the repeats called for."""
    captures: tuple[Observation, ...] = ()
    """Every observation in the order of the captures, those rejected as strays among them."""
    torn: tuple[int, ...] = ()
    """Cells whose repeats scatter far more than all others: they have the deviation that they show."""


def group(
    observations: Iterable[Observation], laser_ids: Sequence[str], noise: NoiseSpec
) -> tuple[MeanObservations, list[Rejected]]:
    """Average the repeats of each laser at each placement; repeats far from their fellows are rejected.

    Where the repeats scatter significantly more than their stated deviations, all of these are enlarged to
    match (`MeanObservations.repeat_scale`). A spot whose repeats alone do (`MeanObservations.torn`) has its
    own deviation enlarged, and the others keep theirs.

    Raises:
        BadInputError: observations of one placement disagree about where the target stood.
    """
    buckets: dict[tuple[str, str], list[Observation]] = defaultdict(list)
    placements: dict[str, PlacementInfo] = {}
    seen = list(observations)
    for s in seen:
        buckets[s.placement, s.laser_id].append(s)
        _check_placement(placements.setdefault(s.placement, PlacementInfo.of(s)), s)
    kept: dict[tuple[str, str], list[Observation]] = {}
    rejected: list[Rejected] = []
    usual = usual_scale([_scatter(members, noise) for members in buckets.values()])
    for key, members in buckets.items():
        left, dropped = _without_strays(members, noise, usual)
        rejected += dropped
        if left:  # repeats may lie apart one in u and the next in v: then none is left
            kept[key] = left
    scatter = [_scatter(members, noise) for members in kept.values()]
    torn = [n for n, one in enumerate(scatter) if is_torn(one, usual)]
    alike = [one for n, one in enumerate(scatter) if n not in torn]
    scale = float(scale_called_for(sum(chi2 for chi2, _ in alike), sum(free for _, free in alike)))
    scales = [(chi2 / free) ** 0.5 if n in torn else scale for n, (chi2, free) in enumerate(scatter)]
    means = [
        weighted_mean(positions(m), own * stated_sd(m, noise))
        for m, own in zip(kept.values(), scales, strict=True)
    ]
    seen_at = {placement for placement, _ in kept}
    order = [key for key in placements if key in seen_at]
    return (
        MeanObservations(
            placements=tuple(placements[key] for key in order),
            laser=np.array([laser_ids.index(laser) for _, laser in kept], dtype=np.intp),
            placement=np.array([order.index(placement) for placement, _ in kept], dtype=np.intp),
            position_px=np.array([mean for mean, _ in means]).reshape(-1, 2),
            sd_px=np.array([np.hypot(sd, noise.speckle_sd_px) for _, sd in means]).reshape(-1, 2),
            time=_mean_times(seen, list(kept.values())),
            members=tuple(tuple(m) for m in kept.values()),
            repeat_scale=scale,
            captures=tuple(seen),
            torn=tuple(torn),
        ),
        rejected,
    )


def _mean_times(captured: Sequence[Observation], cells: Sequence[Sequence[Observation]]) -> FloatArray:
    """(N,) `MeanObservations.time`, by the order in which the observations were captured."""
    last = max(len(captured) - 1, 1)
    time = {id(s): n / last - 0.5 for n, s in enumerate(captured)}
    return np.array([np.mean([time[id(s)] for s in members]) for members in cells])


def positions(observations: Sequence[Observation]) -> FloatArray:
    """(n, 2) measured u, v."""
    return np.array([(s.u_px, s.v_px) for s in observations]).reshape(-1, 2)


def stated_sd(observations: Sequence[Observation], noise: NoiseSpec) -> FloatArray:
    """(n, 2) standard deviation of each position, the rig's where none is stated."""
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in observations]).reshape(-1, 2)
    return np.where(np.isfinite(sd), sd, noise.spot_sd_px)


def _check_placement(first: PlacementInfo, observation: Observation) -> None:
    other = PlacementInfo.of(observation)
    if other.told != first.told:
        raise BadInputError(
            f"{observation.source}: standoff_mm: expected what {first.source} says of the same placement"
            f" {first.key} ({first.describe}), got {other.describe}; give other placements other names"
        )


def _without_strays(
    members: Sequence[Observation], noise: NoiseSpec, usual: float
) -> tuple[list[Observation], list[Rejected]]:
    position, sd = positions(members), stated_sd(members, noise)
    stray = strays(position, sd) | strays_of_few(position, usual * sd)
    kept = [s for s, out in zip(members, stray.tolist(), strict=True) if not out]
    median = np.nanmedian(position, axis=0) if stray.any() else np.zeros(2)
    dropped = [
        Rejected(
            s.source,
            f"laser {s.laser_id} at {s.standoff_mm:g} mm:"
            f" {np.nanmax(np.abs(p - median)):.2f} px from its other repeats",
            stray=s,
        )
        for s, p, out in zip(members, position, stray.tolist(), strict=True)
        if out
    ]
    return kept, dropped


def _scatter(members: Sequence[Observation], noise: NoiseSpec) -> tuple[float, int]:
    return scatter_chi2(positions(members), stated_sd(members, noise))
