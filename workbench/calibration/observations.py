"""From single sightings of a spot to what the fit needs: one mean position for each laser and placement."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.model.rig import NoiseSpec

FloatArray = NDArray[np.float64]
REPEAT_LIMIT_SD = 6.0
"""A repeat this far from the median of its fellows is no repeat: 1 in 5e8 by chance."""
FEWEST_FOR_MEDIAN = 4


@dataclass(frozen=True)
class Sighting:
    """One laser's spot in one capture, of a target at a known standoff. NaN: not measured or not stated."""

    source: str
    """Where it comes from, for people: `row 3`, or a capture's key."""
    laser_id: str
    placement: str
    """Sightings with the same placement share the error of its standoff."""
    standoff_mm: float
    repeat: int
    u_px: float
    v_px: float
    u_sd_px: float = float("nan")
    v_sd_px: float = float("nan")
    standoff_sd_mm: float = float("nan")
    yaw_deg: float = 0.0
    """Tilt of the target about the vertical, as it was set."""


@dataclass(frozen=True)
class Rejected:
    """A sighting or row that the fit did not use."""

    source: str
    reason: str


@dataclass(frozen=True)
class PlacementInfo:
    """One placing of the target, as the ruler and the technician tell it."""

    key: str
    standoff_mm: float
    standoff_sd_mm: float
    """NaN when not stated: the rig's is used."""
    yaw_deg: float


@dataclass(frozen=True)
class Cells:
    """Mean positions, one for each laser and placement that was seen; arrays of length N.

    The mean of the repeats and its standard deviation are sufficient for the fit: nothing that the fit can
    explain differs between repeats.
    """

    placements: tuple[PlacementInfo, ...]
    laser: NDArray[np.intp]
    placement: NDArray[np.intp]
    position_px: FloatArray
    """(N, 2) u, v; NaN where a coordinate was not measured."""
    sd_px: FloatArray
    """(N, 2) 1 sigma of the mean, shared error of the repeats included."""
    members: tuple[tuple[Sighting, ...], ...]
    """The sightings behind each mean."""


def group(
    sightings: Iterable[Sighting], laser_ids: Sequence[str], noise: NoiseSpec
) -> tuple[Cells, list[Rejected]]:
    """Average the repeats of each laser at each placement; repeats far from their fellows are rejected."""
    buckets: dict[tuple[str, str], list[Sighting]] = defaultdict(list)
    placements: dict[str, PlacementInfo] = {}
    for s in sightings:
        buckets[s.placement, s.laser_id].append(s)
        placements.setdefault(
            s.placement, PlacementInfo(s.placement, s.standoff_mm, s.standoff_sd_mm, s.yaw_deg)
        )
    order = list(placements)
    rejected: list[Rejected] = []
    rows = []
    for (placement, laser_id), members in buckets.items():
        kept, dropped = _reject_strays(members, noise)
        rejected += dropped
        mean, sd = _average(kept, noise)
        rows.append((laser_ids.index(laser_id), order.index(placement), mean, sd, tuple(kept)))
    return (
        Cells(
            placements=tuple(placements.values()),
            laser=np.array([row[0] for row in rows], dtype=np.intp),
            placement=np.array([row[1] for row in rows], dtype=np.intp),
            position_px=np.array([row[2] for row in rows]).reshape(-1, 2),
            sd_px=np.array([row[3] for row in rows]).reshape(-1, 2),
            members=tuple(row[4] for row in rows),
        ),
        rejected,
    )


def positions(sightings: Sequence[Sighting]) -> FloatArray:
    """(n, 2) measured u, v."""
    return np.array([(s.u_px, s.v_px) for s in sightings]).reshape(-1, 2)


def _stated_sd(sightings: Sequence[Sighting], noise: NoiseSpec) -> FloatArray:
    """(n, 2) standard deviation of each position, the rig's where none is stated."""
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in sightings]).reshape(-1, 2)
    return np.where(np.isfinite(sd), sd, noise.spot_sd_px)


def _average(sightings: Sequence[Sighting], noise: NoiseSpec) -> tuple[FloatArray, FloatArray]:
    """Mean weighted by the stated variances, and its standard deviation."""
    weight = 1.0 / _stated_sd(sightings, noise) ** 2
    mean = (weight * positions(sightings)).sum(axis=0) / weight.sum(axis=0)
    return mean, np.sqrt(1.0 / weight.sum(axis=0) + noise.speckle_sd_px**2)


def _reject_strays(members: Sequence[Sighting], noise: NoiseSpec) -> tuple[list[Sighting], list[Rejected]]:
    if len(members) < FEWEST_FOR_MEDIAN:
        return list(members), []
    position = positions(members)
    distance = np.abs(position - np.median(position, axis=0))
    scatter = 1.4826 * np.median(distance, axis=0)
    limit = REPEAT_LIMIT_SD * np.maximum(scatter, _stated_sd(members, noise))
    stray = [bool(np.any(far)) for far in distance > limit]
    kept = [s for s, out in zip(members, stray, strict=True) if not out]
    dropped = [
        Rejected(s.source, f"laser {s.laser_id} at {s.standoff_mm:g} mm: {d:.2f} px from its other repeats")
        for s, out, d in zip(members, stray, np.nanmax(distance, axis=1), strict=True)
        if out
    ]
    return kept, dropped
