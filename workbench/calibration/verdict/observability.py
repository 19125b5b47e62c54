"""Null directions: combinations of parameters that the data leave open.

The information of the data is the inverse posterior covariance minus that of the priors. Parameters are taken
in turn, those that all spots depend on first. A parameter is open where the data constrain it less than its
own prior does, with all others free. The change of the others that hides its change is a null direction.
The parameter is then held fixed and the next one taken: eigenvectors of the information would mix directions
that are equally open, and could not be named.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from workbench.calibration.estimation.fit import FLAT_PRIOR_SD
from workbench.calibration.model.parameters import PRINT, Parameter
from workbench.calibration.verdict.null_direction_text import (
    ParameterGroup,
    advice,
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
"""Change of ranges, in their sd, below which a direction does not affect them: it adds at most some 5 %."""
WIDE_PRIOR_SD = 10.0
"""Factor on the priors' sd in the search for the change that hides a parameter. At their full weight noise of
the data enters the direction; with no priors, parameters that nothing constrains would drift."""
SHOWN = 4
"""Number of directions in the warnings."""


@dataclass(frozen=True)
class NullDirection:
    """Change of several parameters that leaves every spot unchanged, at 1 sigma of the posterior."""

    change: dict[str, float]
    """By name, each in its unit; the pivot comes first."""
    lasers: tuple[str, ...]
    """Lasers for each of which the direction holds separately; empty where it involves several or none."""
    words: str
    remedy: str
    relative_range_change: float
    """The largest of any range of any laser."""
    hurts_ranges: bool

    @property
    def line(self) -> str:
        """Text of the warning."""
        size = f"{100 * self.relative_range_change:.2g} %"
        ranges = f"Ranges change by up to {size}" if self.hurts_ranges else "Ranges are not affected"
        return f"{self.words}. {ranges}. {advice(self.remedy)}".rstrip()


class RangeGradients(NamedTuple):
    """K ranges of spots in the image."""

    by_parameter: FloatArray
    """(K, S) derivatives of ln(range)."""
    sd: FloatArray
    """(K,) relative sd of a single reading."""


@dataclass(frozen=True)
class _Posterior:
    """Posterior of the F free parameters, in units of their prior sd."""

    rig: Rig
    parameters: tuple[Parameter, ...]
    value: FloatArray
    """(F,) in the parameters' units."""
    covariance: FloatArray
    """(F, F)"""
    information: FloatArray
    """(F, F) of the data alone."""
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
    """Null directions, those that change ranges most first.

    Directions of the same kind, each of a single laser, are joined into one.

    Args:
        rig: the lasers.
        parameters: S parameters of the sensor.
        values: (S,) their values.
        covariance: (S, S) posterior.
        ranges: ranges on which the effect of a direction is evaluated.
    """
    posterior = _posterior(rig, parameters, values, covariance, ranges)
    found: dict[tuple[str, ...], tuple[NullDirection, tuple[ParameterGroup, ...]]] = {}
    for pivot, direction in _directions(posterior):
        groups = _groups(posterior, pivot, direction)
        if groups[0].members[0].shown < 0:
            direction = -direction
            groups = _groups(posterior, pivot, direction)
        one = _described(posterior, direction, groups)
        key = ("each", *(g.kind for g in groups)) if one.lasers else ("", posterior.names[pivot])
        found[key] = (_joined(rig, *found[key], one), groups) if key in found else (one, groups)
    return tuple(sorted((one for one, _ in found.values()), key=lambda d: -d.relative_range_change))


def direction_lines(directions: Sequence[NullDirection]) -> list[str]:
    """Warnings of the SHOWN combinations that change ranges most; single parameters are left to the table."""
    lines = [d.line for d in directions if len(d.change) > 1]
    more = len(lines) - SHOWN
    if more <= 0:
        return lines
    are = "combination of parameters is" if more == 1 else "combinations of parameters are"
    return [*lines[:SHOWN], f"{more} more {are} not constrained."]


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
    """Pivots with their null directions (F,): the pivot changes by its posterior sd, the others hide it.

    With A the information of the data and e the pivot's unit vector, the pivot is open where
    e (A + 0)^-1 e > 1, the prior's variance. The change of the others that costs the least chi-square is
    (A + 1 / WIDE_PRIOR_SD^2)^-1 e, normalised at the pivot.
    """
    names = posterior.names
    order = dict.fromkeys((*REFERENCE_FIRST, *posterior.rig.camera.lens_priors))
    shared = [names.index(name) for name in order if name in names]
    rest = list(range(len(names)))
    for pivot in [*shared, *(i for i in rest if i not in shared)]:
        information, at = posterior.information[np.ix_(rest, rest)], rest.index(pivot)
        unit = np.eye(len(rest))
        if np.linalg.inv(information + unit / FLAT_PRIOR_SD**2)[at, at] > 1.0:
            hidden = np.linalg.inv(information + unit / WIDE_PRIOR_SD**2)[:, at]
            direction = np.zeros(len(names))
            direction[rest] = hidden / hidden[at] * np.sqrt(np.linalg.inv(information + unit)[at, at])
            yield pivot, direction
            rest.remove(pivot)


def _groups(posterior: _Posterior, pivot: int, direction: FloatArray) -> tuple[ParameterGroup, ...]:
    """The parameters of a direction by kind, the pivot's group among them."""
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


def _described(
    posterior: _Posterior, direction: FloatArray, groups: tuple[ParameterGroup, ...]
) -> NullDirection:
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


def _joined(
    rig: Rig, before: NullDirection, groups: tuple[ParameterGroup, ...], one: NullDirection
) -> NullDirection:
    """A direction extended by the same direction of another laser."""
    each = (*before.lasers, *one.lasers)
    return replace(
        before,
        change=before.change | one.change,
        lasers=each,
        words=describe(rig, groups, each),
        relative_range_change=max(before.relative_range_change, one.relative_range_change),
        hurts_ranges=before.hurts_ranges or one.hurts_ranges,
    )
