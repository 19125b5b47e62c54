"""What the data leave open: changes of several parameters at once that move no spot.

The information of the data on the sensor is what its posterior holds beyond the priors. Parameters are taken
in turn, those that many spots share first. One is open where the data tell less of it than its own prior,
however freely all others may move. The way the others move to hide it is a null direction. It is named, the
parameter is held, and the next one taken: so directions that are all equally open do not come out mixed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from workbench.calibration.estimation.fit import FLAT_PRIOR_SD
from workbench.calibration.model.parameters import PRINT, Parameter
from workbench.calibration.verdict.null_direction_text import (
    Group,
    describe,
    group_by_kind,
    own_laser,
    parameter_change,
    remedy,
)
from workbench.model.arrays import FloatArray
from workbench.model.rig import TARGET_TILT, Rig

REFERENCE_FIRST = ("ruler_scale", *PRINT, "offset_mm", "f_px", *TARGET_TILT)
"""Parameters that all spots share, in the order in which they are taken; the rest of the lens follows.

A slope is a depth over a length across: it scales with f_px and the baselines, and is taken after them.
"""
NOT_HURT = 1 / 3
"""A direction that moves ranges by less than this part of their sd adds at most some 5 % to it."""
WIDE_PRIOR_SD = 10.0
"""In the search for what hides a parameter priors count so much less. With their full weight the data's noise
gets into it, with none the others drift wherever nothing holds them."""
SHOWN = 4


@dataclass(frozen=True)
class NullDirection:
    """Parameters that trade with each other, moved by 1 sigma of what priors and data leave open."""

    change: dict[str, float]
    """By name, each in its unit; the one that was asked for comes first."""
    lasers: tuple[str, ...]
    """Of each of which this holds by itself; empty where they have to do with each other."""
    words: str
    remedy: str
    relative_range_change: float
    """The largest of any range of any laser."""
    hurts_ranges: bool

    @property
    def line(self) -> str:
        """For people."""
        if self.hurts_ranges:
            size = f"{100 * self.relative_range_change:.2g} %"
            return f"{self.words}. Ranges suffer, by up to {size}. Do: {self.remedy}"
        return f"{self.words}. Ranges do not suffer. Only to know each by itself: {self.remedy}"


class RangeGradients(NamedTuple):
    """K ranges of spots that are in frame."""

    by_parameter: FloatArray
    """(K, S) derivatives of ln(range)."""
    sd: FloatArray
    """(K,) relative, of a single reading."""


@dataclass(frozen=True)
class _Posterior:
    """Of the F free parameters, in units of their prior sd."""

    rig: Rig
    parameters: tuple[Parameter, ...]
    value: FloatArray
    """In the parameters' units."""
    covariance: FloatArray
    information: FloatArray
    """Of the data alone."""
    ranges: RangeGradients

    @property
    def names(self) -> list[str]:
        return [p.name for p in self.parameters]


def information_of(covariance: FloatArray) -> FloatArray:
    """(..., F, F) information of the data, from a posterior covariance in units of the priors."""
    return np.asarray(np.linalg.inv(covariance) - np.eye(covariance.shape[-1]))


def null_directions(
    rig: Rig,
    parameters: Sequence[Parameter],
    values: FloatArray,
    covariance: FloatArray,
    ranges: RangeGradients,
) -> tuple[NullDirection, ...]:
    """Directions of which priors tell more than the data, those that move ranges most first.

    Args:
        rig: its lasers.
        parameters: S of the sensor.
        values: (S,)
        covariance: (S, S) posterior.
        ranges: those that matter.
    """
    posterior = _posterior(rig, parameters, values, covariance, ranges)
    found: dict[tuple[str, ...], tuple[NullDirection, tuple[Group, ...]]] = {}
    for pivot, direction in _directions(posterior):
        groups = _groups(posterior, pivot, direction)
        if groups[0].members[0].shown < 0:
            direction = -direction
            groups = _groups(posterior, pivot, direction)
        one = _named(posterior, direction, groups)
        alike = ("each", *(g.kind for g in groups)) if one.lasers else ("", posterior.names[pivot])
        found[alike] = (_joined(rig, *found[alike], one), groups) if alike in found else (one, groups)
    return tuple(sorted((one for one, _ in found.values()), key=lambda d: -d.relative_range_change))


def direction_lines(directions: Sequence[NullDirection]) -> list[str]:
    """For people, the few combinations that matter most; what stands alone is seen in the table."""
    lines = [d.line for d in directions if len(d.change) > 1]
    left = len(lines) - SHOWN
    return (
        lines
        if left <= 0
        else [*lines[:SHOWN], f"{left} more such combination{'s' * (left > 1)} cannot be known apart"]
    )


def _posterior(
    rig: Rig,
    parameters: Sequence[Parameter],
    values: FloatArray,
    covariance: FloatArray,
    ranges: RangeGradients,
) -> _Posterior:
    prior_sd = np.array([p.prior.sd for p in parameters])
    free = np.flatnonzero(prior_sd > 0)
    scaled = covariance[np.ix_(free, free)] / np.outer(prior_sd[free], prior_sd[free])
    return _Posterior(
        rig=rig,
        parameters=tuple(parameters[i] for i in free.tolist()),
        value=values[free],
        covariance=scaled,
        information=information_of(scaled),
        ranges=RangeGradients(ranges.by_parameter[:, free] * prior_sd[free], ranges.sd),
    )


def _directions(posterior: _Posterior) -> Iterator[tuple[int, FloatArray]]:
    """Each pivot, and (F,) how all move: the pivot by its posterior sd, the others to hide it."""
    names = posterior.names
    order = dict.fromkeys((*REFERENCE_FIRST, *posterior.rig.camera.lens_priors))
    shared = [names.index(name) for name in order if name in names]
    rest = list(range(len(names)))
    for pivot in [*shared, *(i for i in rest if i not in shared)]:
        information, at = posterior.information[np.ix_(rest, rest)], rest.index(pivot)
        unit = np.eye(len(rest))
        if np.linalg.inv(information + unit / FLAT_PRIOR_SD**2)[at, at] > 1.0:  # of the prior's variance
            hidden = np.linalg.inv(information + unit / WIDE_PRIOR_SD**2)[:, at]
            direction = np.zeros(len(names))
            direction[rest] = hidden / hidden[at] * np.sqrt(np.linalg.inv(information + unit)[at, at])
            yield pivot, direction
            rest.remove(pivot)


def _groups(posterior: _Posterior, pivot: int, direction: FloatArray) -> tuple[Group, ...]:
    effect = np.abs(direction) * np.sqrt(np.maximum(np.diag(posterior.information), 0.0))
    order = [pivot, *(i for i in range(len(direction)) if i != pivot)]
    return group_by_kind(
        parameter_change(
            posterior.rig,
            posterior.names[i],
            float(posterior.value[i]),
            float(direction[i] * posterior.parameters[i].prior.sd),
            float(effect[i]),
        )
        for i in order
    )


def _named(posterior: _Posterior, direction: FloatArray, groups: tuple[Group, ...]) -> NullDirection:
    names = posterior.names
    members = [names.index(m.name) for group in groups for m in group.members]
    sd = [p.prior.sd for p in posterior.parameters]
    shift = np.abs(posterior.ranges.by_parameter @ direction)
    own = own_laser(posterior.rig, groups)
    each = (own,) if own else ()
    return NullDirection(
        change={names[i]: float(direction[i] * sd[i]) for i in members},
        lasers=each,
        words=describe(posterior.rig, groups, each),
        remedy=remedy(groups, each),
        relative_range_change=float(shift.max(initial=0.0)),
        hurts_ranges=bool((shift > NOT_HURT * posterior.ranges.sd).any()),
    )


def _joined(rig: Rig, before: NullDirection, groups: tuple[Group, ...], one: NullDirection) -> NullDirection:
    """The same of one laser more."""
    each = (*before.lasers, *one.lasers)
    return replace(
        before,
        change=before.change | one.change,
        lasers=each,
        words=describe(rig, groups, each),
        relative_range_change=max(before.relative_range_change, one.relative_range_change),
        hurts_ranges=before.hurts_ranges or one.hurts_ranges,
    )
