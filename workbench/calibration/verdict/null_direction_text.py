"""Null directions in plain words, and what would resolve them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import atan, degrees, hypot

from workbench.calibration.model.parameters import DRIFT, PRINT
from workbench.model.lens import COEFFICIENTS, PINHOLE
from workbench.model.rig import TARGET_TILT, Rig

LEAST_PART = 0.3
"""What moves the spots by less than this part of what the strongest of a combination does is not named."""
LEAST_EFFECT = 0.5
"""Standard deviations of all spots together: no test of the data sees less than this."""
OTHERS = 3
"""More than so many kinds that trade with one are not told apart by reading."""
BASELINE = "baseline"
ACROSS = "position across"
POINTING = {"tx": "pointing along u", "ty": "pointing along v"}
BOARD = "use the printed board (workbench target)"
SQUARE = "measure the target's tilt with a square or level"
REMEDIES: dict[str, tuple[str, ...]] = {
    "ruler_scale": ("check the ruler against a better one",),
    **dict.fromkeys(PRINT, ("check the board's printed ruler against a steel one",)),
    "offset_mm": ("measure the offset of the reference plane",),
    BASELINE: ("measure a baseline more closely",),
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
"""What all lasers share, in words; the other terms are the lens's."""
LENGTHS = ("ruler_scale", *PRINT)
"""Where one of these is among what trades, nothing but a better ruler tells them apart."""
APART = "place the target at standoffs farther apart"
UNSEEN = "nothing, as long as no spot depends on it"


@dataclass(frozen=True)
class ParameterChange:
    """One parameter of a combination."""

    name: str
    kind: str
    """Its own name, or what it is of a laser."""
    laser: str
    """Empty for what all lasers share."""
    shown: float
    """How far it moves, in `unit`."""
    unit: str
    effect: float
    """On all spots together if it moved alone, in standard deviations."""


@dataclass(frozen=True)
class Group:
    """Parameters of one kind that move together."""

    members: tuple[ParameterChange, ...]

    @property
    def kind(self) -> str:
        """That of all."""
        return self.members[0].kind

    @property
    def lasers(self) -> tuple[str, ...]:
        """Whose they are; empty for what all lasers share."""
        return tuple(m.laser for m in self.members if m.laser)

    @property
    def effect(self) -> float:
        """Of all together."""
        return hypot(*(m.effect for m in self.members))

    @property
    def size(self) -> str:
        """How far they move, for people: the mean; `+-` where some go one way and some the other."""
        unit, shown = self.members[0].unit, [m.shown for m in self.members]
        one_way = min(shown) * max(shown) > 0 or len(shown) == 1
        mean = sum(shown if one_way else map(abs, shown)) / len(shown)
        return (f"{mean:+.2g} {unit}" if one_way else f"+-{mean:.2g} {unit}").rstrip()


def parameter_change(rig: Rig, name: str, value: float, change: float, effect: float) -> ParameterChange:
    """A parameter that moves by `change` from `value`, both in its own unit."""
    laser, _, own = name.rpartition(".")
    if not laser:
        kind = name
    elif own in POINTING:
        kind = POINTING[own]
    else:
        along = "x_mm" if rig.lasers[rig.laser_ids.index(laser)].axis == "u" else "y_mm"
        kind = BASELINE if own == along else ACROSS
    shown, unit = _shown(kind, value, change)
    return ParameterChange(name, kind, laser, shown, unit, effect)


def group_by_kind(parts: Iterable[ParameterChange]) -> tuple[Group, ...]:
    """What moves together, by kind: the first part's group and the strongest others, lasers' last."""
    buckets: dict[str, list[ParameterChange]] = {}
    for part in parts:
        buckets.setdefault(part.kind, []).append(part)
    first, *others = [Group(_strong(members)) for members in buckets.values()]
    least = max(LEAST_PART * max(group.effect for group in (first, *others)), LEAST_EFFECT)
    named = sorted((group for group in others if group.effect > least), key=lambda group: -group.effect)
    return tuple(sorted((first, *named[:OTHERS]), key=lambda group: bool(group.lasers)))


def describe(rig: Rig, groups: Sequence[Group], each: Sequence[str] = ()) -> str:
    """A sentence without its full stop.

    Args:
        rig: how many lasers there are.
        groups: what trades.
        each: lasers of each of which this holds by itself.
    """
    names = [_phrase(rig, group, bool(each)) for group in groups]
    of = f" of {', '.join(each)}{', each by itself' if len(each) > 1 else ''}" if each else ""
    sizes = _listed([group.size for group in groups])
    if len(names) == 1:
        return f"{names[0]}{of} cannot be known: changed by {sizes}, it moves no spot by more than its noise"
    return f"{_listed(names)}{of} cannot be known apart: changed together by {sizes}, they move no spot"


def remedy(groups: Sequence[Group], each: Sequence[str] = ()) -> str:
    """What would tell the parameters apart."""
    if len(groups) == 1:
        return UNSEEN
    if each:
        return APART
    kinds = {group.kind for group in groups}
    only_lengths = kinds.intersection(LENGTHS)
    fitting = [texts for kind, texts in REMEDIES.items() if kind in (only_lengths or kinds)]
    return ", or ".join(dict.fromkeys(chain(*fitting))) or APART


def own_laser(rig: Rig, groups: Sequence[Group]) -> str:
    """The laser whose own affair this is; empty where others or what they share have a part in it."""
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


def _phrase(rig: Rig, group: Group, each: bool) -> str:
    if not group.lasers:
        words = SHARED.get(group.kind)
        return f"{words} ({group.kind})" if words else f"the lens term {group.kind}"
    if each or len(rig.lasers) == 1:
        return f"the {group.kind}"
    if len(group.lasers) < len(rig.lasers):
        return f"the {group.kind} of {', '.join(group.lasers)}"
    return "all baselines" if group.kind == BASELINE else f"the {group.kind} of all lasers"
