"""The questions that every procedure asks."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.prompt import Action, Prompt, Quantity
from workbench.model.rig import Rig
from workbench.model.target import BoardTarget, Placement

SAFETY = "safety"
"""Key of the confirmation before the first emission; asked again whenever a session goes on."""
MISREAD = 0.1
"""A standoff that differs by more than this share from what was asked for is taken for a slip."""


def safety_prompt(rig: Rig) -> Prompt:
    """Eyewear and beam path, before the first emission of a session."""
    laser_class: str = getattr(rig, "laser_class", None) or "3R"
    return Prompt(
        key=SAFETY,
        do=f"Lasers of class {laser_class} are about to be switched on: {_protect(laser_class)}.",
        expect="The beams end on the target; no mirror, ring or watch is in their way; nobody is near.",
        otherwise="Do not confirm: close the beam path first, or abort.",
        at_bench=True,
    )


def placement_prompt(placement: Placement, before: Placement | None) -> Prompt:
    """Have the target placed, and read its standoff; `before` may be captured again instead."""
    at = placement.standoff_mm
    return Prompt(
        key=placement.key,
        do=f"Place the {_target(placement)} at {at:g} mm{_turn(placement)}.",
        expect="Its face is square to the ruler unless turned, and every spot lies on it.",
        otherwise="As near as it goes is good: give the standoff that the ruler shows.",
        quantity=Quantity("mm", (1 - MISREAD) * at, (1 + MISREAD) * at, at),
        at_bench=True,
        may=_instead(placement, before),
    )


def placement_prompts(placements: Sequence[Placement]) -> list[Prompt]:
    """Prompts of placements that follow one another."""
    return [placement_prompt(*pair) for pair in zip(placements, [None, *placements], strict=False)]


def captures_prompt(key: str, failed: str, placement: Placement, where: str = "") -> Prompt:
    """What to do about a limit that failed; `where` is of a spot that was not seen."""
    here = f"{placement.standoff_mm:g} mm"
    return Prompt(
        key=key,
        do=f"{failed}. {'Go on without this laser here?' if where else 'Keep these captures?'}",
        expect=where or "The spot is whole, lies on the target, and nothing reflects it.",
        otherwise="Put right what is wrong, then `redo`.",
        yes="keep what the other lasers gave" if where else "keep them",
        may={"redo": f"{here} again", "skip": f"leave {here} out"},
    )


def _instead(placement: Placement, before: Placement | None) -> dict[Action, str]:
    """What else can be done, by the standoffs: at this prompt `redo` is of the placement before."""
    here = f"{placement.standoff_mm:g} mm"
    if before is None:
        return {"skip": f"leave {here} out"}
    again = f"{before.standoff_mm:g} mm"
    if again == here:  # of a board, turned otherwise
        return {"redo": "the one before", "skip": "leave this one out"}
    return {"redo": f"{again} again", "skip": f"leave {here} out"}


def _protect(laser_class: str) -> str:
    if laser_class in {"1", "2"}:
        return "do not stare into a beam; no eyewear is needed for a glance"
    return "put on eyewear for their wavelength, and screen the beam path"


def _target(placement: Placement) -> str:
    return "board" if isinstance(placement.target, BoardTarget) else "target"


def _turn(placement: Placement) -> str:
    target = placement.target
    yaw, pitch = getattr(target, "yaw_deg", 0.0), getattr(target, "pitch_deg", 0.0)
    turns = [
        f"its {'right' if yaw > 0 else 'left'} side {abs(yaw):g} deg away" if yaw else "",
        f"its {'lower' if pitch > 0 else 'upper'} side {abs(pitch):g} deg away" if pitch else "",
    ]
    told = " and ".join(turn for turn in turns if turn)
    return f", {told}" if told else ""
