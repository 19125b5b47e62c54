"""Text of null directions and of the measurements that would resolve them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import atan, degrees, hypot

from workbench.calibration.model.parameters import DRIFT, PRINT
from workbench.model.lens import COEFFICIENTS, PINHOLE
from workbench.model.rig import TARGET_TILT, Rig
from workbench.optics.rows import axes_of, rays_of_rig

LEAST_PART = 0.3
"""Least effect on the spots, as a share of the strongest, for a parameter to be part of the text."""
LEAST_EFFECT = 0.5
"""Effect on all spots together, in standard deviations, below which no test of the data sees it."""
OTHERS = 3
"""Largest number of kinds beside the pivot's in one text."""
LEAST_SHARE = 0.25
"""Least share of a coordinate in the direction of the baseline to be named after it."""
BASELINE = "baseline"
ACROSS = "position across the baseline"
POINTING = {"tx": "pointing along u", "ty": "pointing along v"}
BOARD = "use the printed board"
SQUARE = "measure the target's tilt with a square"
REMEDIES: dict[str, tuple[str, ...]] = {
    "ruler_scale": ("check the ruler against a more accurate one",),
    **dict.fromkeys(PRINT, ("check the board's printed ruler against a steel ruler",)),
    "offset_mm": ("measure the offset of the reference plane",),
    BASELINE: ("measure one baseline more accurately",),
    **dict.fromkeys(TARGET_TILT, (SQUARE, BOARD)),
    **dict.fromkeys(DRIFT, ("return to a standoff at the end of the session",)),
    **dict.fromkeys((*PINHOLE, *chain(*COEFFICIENTS.values())), (BOARD,)),
}
SHARED = {
    "f_px": "the focal length",
    **dict.fromkeys(("cx_px", "cy_px"), "the image centre"),
    "offset_mm": "the reference plane's offset",
    "ruler_scale": "the ruler's scale",
    **dict.fromkeys(PRINT, "the board's scale"),
    **dict(
        zip(
            TARGET_TILT,
            ("the target's common tilt about the vertical", "the target's common tilt about the horizontal"),
            strict=True,
        )
    ),
    **dict(zip(DRIFT, ("the drift of the image along u", "the drift of the image along v"), strict=True)),
}
"""Names of the parameters that all lasers share, except those of the lens."""
LENGTHS = ("ruler_scale", *PRINT)
"""Scales of all lengths. Where one takes part, only a more accurate ruler separates the parameters."""
APART = "place the target at standoffs farther apart"
NO_EFFECT = "none: no spot depends on it"


@dataclass(frozen=True)
class ParameterChange:
    """One parameter of a combination."""

    name: str
    kind: str
    """Its own name, or its role in a laser (BASELINE, ACROSS, POINTING)."""
    laser: str
    """Empty for parameters that all lasers share."""
    shown: float
    """Change, in `unit`."""
    unit: str
    effect: float
    """Change of all spots together by this parameter alone, in standard deviations."""


@dataclass(frozen=True)
class ParameterGroup:
    """Parameters of one kind that change together."""

    members: tuple[ParameterChange, ...]

    @property
    def kind(self) -> str:
        """Kind of all members."""
        return self.members[0].kind

    @property
    def lasers(self) -> tuple[str, ...]:
        """Lasers of the members; empty for parameters that all lasers share."""
        return tuple(m.laser for m in self.members if m.laser)

    @property
    def effect(self) -> float:
        """Effect of all members together (root sum of squares)."""
        return hypot(*(m.effect for m in self.members))

    @property
    def size(self) -> str:
        """Mean change as text; `+-` for the mean absolute change where the signs differ."""
        shown = [m.shown for m in self.members]
        one_way = min(shown) * max(shown) > 0 or len(shown) == 1
        mean = sum(shown if one_way else map(abs, shown)) / len(shown)
        return (f"{mean:+.2g} {self.unit}" if one_way else f"+-{mean:.2g} {self.unit}").rstrip()

    @property
    def unit(self) -> str:
        """Unit of all changes."""
        return self.members[0].unit


def parameter_change(rig: Rig, name: str, value: float, change: float, effect: float) -> ParameterChange:
    """Change of a parameter by `change` from `value`, both in its own unit."""
    laser, _, own = name.rpartition(".")
    if not laser:
        kind = name
    elif own in POINTING:
        kind = POINTING[own]
    else:
        kind = BASELINE if own in _along(rig, laser) else ACROSS
    shown, unit = _shown(kind, value, change)
    return ParameterChange(name, kind, laser, shown, unit, effect)


def _along(rig: Rig, laser_id: str) -> list[str]:
    """Coordinates of a laser's origin along its baseline."""
    (axis,) = axes_of(rays_of_rig(rig)[[rig.laser_ids.index(laser_id)]])
    return [name for name, share in zip(("x_mm", "y_mm"), axis, strict=True) if abs(share) >= LEAST_SHARE]


def group_by_kind(parts: Iterable[ParameterChange]) -> tuple[ParameterGroup, ...]:
    """Groups by kind: that of the first part and the strongest others, those of lasers last."""
    buckets: dict[str, list[ParameterChange]] = {}
    for part in parts:
        buckets.setdefault(part.kind, []).append(part)
    first, *others = [ParameterGroup(_strong(members)) for members in buckets.values()]
    least = max(LEAST_PART * max(group.effect for group in (first, *others)), LEAST_EFFECT)
    strong = sorted((group for group in others if group.effect > least), key=lambda group: -group.effect)
    return tuple(sorted((first, *strong[:OTHERS]), key=lambda group: bool(group.lasers)))


def describe(rig: Rig, groups: Sequence[ParameterGroup], each: Sequence[str] = ()) -> str:
    """Sentence about a null direction, without full stop.

    Args:
        rig: the lasers.
        groups: the parameters.
        each: lasers for each of which the direction holds separately.
    """
    names = [_phrase(rig, group, bool(each)) for group in groups]
    of = f" of {'each of ' if len(each) > 1 else ''}{', '.join(each)}" if each else ""
    if len(names) == 1:
        return f"{names[0]}{of}: not constrained ({groups[0].size} moves no spot by more than its noise)"
    how = "scale" if all(group.unit == "%" for group in groups) else "change"
    sizes = " / ".join(group.size for group in groups)
    return f"{_listed(names)}{of} {how} together ({sizes} leaves every spot unchanged)"


def remedy(groups: Sequence[ParameterGroup], each: Sequence[str] = ()) -> str:
    """Measurement that would separate the parameters."""
    if len(groups) == 1:
        return NO_EFFECT
    if each:
        return APART
    kinds = {group.kind for group in groups}
    only_lengths = kinds.intersection(LENGTHS)
    fitting = [texts for kind, texts in REMEDIES.items() if kind in (only_lengths or kinds)]
    return " or ".join(dict.fromkeys(chain(*fitting))) or APART


def advice(remedy: str) -> str:
    """Sentence with a remedy; empty where none is needed."""
    return "" if remedy == NO_EFFECT else f"To separate them, {remedy}."


def own_laser(rig: Rig, groups: Sequence[ParameterGroup]) -> str:
    """The only laser with parameters in the groups; empty where several or shared parameters take part."""
    lasers = {m.laser for group in groups for m in group.members}
    return lasers.pop() if len(lasers) == 1 and len(rig.lasers) > 1 else ""


def _strong(members: Sequence[ParameterChange]) -> tuple[ParameterChange, ...]:
    least = LEAST_PART * max(m.effect for m in members)
    return tuple(m for m in members if m.effect >= least)


def _shown(kind: str, value: float, change: float) -> tuple[float, str]:
    if kind in {"f_px", BASELINE} and value:
        return 100.0 * change / value, "%"
    if kind in LENGTHS:
        return 100.0 * change, "%"
    if kind in TARGET_TILT:
        return degrees(atan(value + change) - atan(value)), "deg"
    if kind in POINTING.values():
        return 1000.0 * change, "mrad"
    if kind in (BASELINE, ACROSS):
        return change, "mm"
    return change, next((unit for unit in ("px", "mm") if kind.endswith(unit)), "")


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _phrase(rig: Rig, group: ParameterGroup, each: bool) -> str:
    if not group.lasers:
        return group.kind
    if each or len(rig.lasers) == 1:
        return f"the {group.kind}"
    if len(group.lasers) < len(rig.lasers):
        return f"the {group.kind} of {', '.join(group.lasers)}"
    return "the baselines" if group.kind == BASELINE else f"the {group.kind} of all lasers"
