"""Prompts common to all procedures: safety, placements, failed limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from workbench.model.prompt import Action, Prompt, Quantity
from workbench.model.rig import LaserClass, Rig
from workbench.model.target import BoardTarget, CylinderTarget, FlatTarget, Placement, WorldTarget

SAFETY = "safety"
"""Key of the confirmation before the first emission; asked again when a session is resumed."""
LASER_CLASS = "laser_class"
"""Key of the question about the class of the lasers."""
SPECULAR = (
    "WARNING: a glossy cylinder reflects the beams sideways like a mirror. Cover it with matt white paper,"
    " and keep eyes and shiny things out of the plane of the beams."
)
"""Warning before a beam meets a curved surface, which spreads specular reflections in its plane."""
MEASURE = "Place it as near as possible and enter the standoff that the ruler shows."
MOVE = "Move it until they do; the number may stay as it is."
"""Instructions for another sight, where the standoff is measured, and where it need not be."""
MISREAD = 0.1
"""Largest relative difference of an entered standoff from the requested one; beyond it, it is refused."""


def safety_prompt(rig: Rig) -> Prompt:
    """Confirmation of eyewear and beam path before the first emission of a session."""
    return Prompt(
        key=SAFETY,
        do=_protect(rig.laser_class),
        expect="The beams end on the target; no mirror, ring or watch is in their path; no person is near.",
        otherwise="Do not confirm: close the beam path first, or abort.",
        at_bench=True,
    )


def laser_class_prompt() -> Prompt:
    """Question about the class of the lasers, where the rig file does not state it."""
    return Prompt(
        key=LASER_CLASS,
        do="Class of the lasers (IEC 60825-1), as on their label? Of several, the most dangerous.",
        otherwise="Without a label, abort: no beam is switched on before its class is known.",
        choices=get_args(get_args(LaserClass)[0]),
        at_bench=True,
    )


def placement_prompt(placement: Placement, before: Placement | None) -> Prompt:
    """Instruction to place the target, with its standoff as the answer.

    Args:
        placement: requested placement.
        before: previous placement, which may be captured again instead; None if there is none. If the target
            already stands as requested, it must be taken away first, so that the placement is a new one.
    """
    at, name = placement.standoff_mm, _target(placement)
    again = before is not None and (before.standoff_mm, before.target) == (at, placement.target)
    place = f"Take the {name} away and place it again" if again else f"Place the {name}"
    measured = placement.is_measured
    return Prompt(
        key=placement.key,
        do=f"{place} at {'' if measured else 'about '}{at:.6g} mm{_turn(placement)}.{_how(placement)}",
        expect=_expected_sight(placement),
        otherwise=MEASURE if measured else MOVE,
        quantity=Quantity("mm", (1 - MISREAD) * at, (1 + MISREAD) * at, at),
        at_bench=True,
        may=_instead(placement, before),
    )


def placement_prompts(placements: Sequence[Placement]) -> list[Prompt]:
    """Prompts of consecutive placements."""
    return [placement_prompt(*pair) for pair in zip(placements, [None, *placements], strict=False)]


def captures_prompt(key: str, failed: str, placement: Placement, where: str = "") -> Prompt:
    """Question about a failed limit on captures.

    Args:
        key: key of the prompt.
        failed: description of the failure.
        placement: placement of the captures.
        where: expected position of a missing spot; empty if the spot was found.
    """
    here = f"{placement.standoff_mm:g} mm"
    return Prompt(
        key=key,
        do=f"{failed}. {'Continue without this laser here?' if where else 'Keep these captures?'}",
        expect=where or "The spot is complete, lies on the target and has no reflection.",
        otherwise="Remove the cause, then `redo`.",
        yes="keep the captures of the other lasers" if where else "keep them",
        overrules=True,
        may={"redo": f"{here} again", "skip": f"leave {here} out"},
    )


def standoff_key(placement: Placement) -> str:
    """Key of the question about a standoff that contradicts the other placements."""
    return f"{placement.key}/standoff"


def standoff_prompt(placement: Placement, failed: str = "The standoff contradicts the others.") -> Prompt:
    """Question about a standoff that contradicts its prediction, while the target still stands there.

    Args:
        placement: placement as entered.
        failed: description of the contradiction.
    """
    here = f"{placement.standoff_mm:g} mm"
    return Prompt(
        key=standoff_key(placement),
        do=f"{failed} Keep these captures?",
        expect=f"The ruler shows {here}, and the target is square to it.",
        otherwise="Type redo: the target is placed, and its standoff entered, again.",
        yes="keep them: the target stands as entered, another placement may be wrong",
        overrules=True,
        at_bench=True,
        may={"redo": "measure again", "skip": f"leave {here} out"},
    )


def _instead(placement: Placement, before: Placement | None) -> dict[Action, str]:
    """Further actions with their effects; at this prompt `redo` refers to the previous placement."""
    here = f"{placement.standoff_mm:g} mm"
    if before is None:
        return {"skip": f"leave {here} out"}
    again = f"{before.standoff_mm:g} mm"
    if again == here:  # the standoff does not distinguish the placements
        return {"redo": "the previous placement again", "skip": "leave this placement out"}
    return {"redo": f"{again} again", "skip": f"leave {here} out"}


def _protect(laser_class: LaserClass | None) -> str:
    if laser_class is None:
        return (
            "Lasers will be switched on whose class the rig file does not state (laser_class). Find it on"
            " their label. Unless it is 1 or 2, put on eyewear for their wavelength and screen the beam path."
        )
    protection = (
        "do not stare into a beam; no eyewear is needed"
        if laser_class in {"1", "2"}
        else "put on eyewear for their wavelength and screen the beam path"
    )
    return f"Lasers of class {laser_class} will be switched on: {protection}."


def _target(placement: Placement) -> str:
    target = placement.target
    if isinstance(target, CylinderTarget):
        return f"cylinder of {target.diameter_mm:g} mm diameter"
    if isinstance(target, WorldTarget):
        return "vehicle"
    return "board" if isinstance(target, BoardTarget) else "target"


def _how(placement: Placement) -> str:
    """Instructions for a target that is not flat and square, with its reference uncertainties."""
    target, standoff_sd = placement.target, placement.standoff_sd_mm
    if isinstance(target, WorldTarget):
        pose = target.pose
        return (
            f" World {target.world.world}: the middle of its front at x = {pose.x_mm:g} mm,"
            f" y = {pose.y_mm:g} mm, heading {pose.heading_deg:g} deg; the number is its free way ahead."
        )
    ruler = "" if standoff_sd is None else f" Standard uncertainty of the standoff: {standoff_sd:g} mm."
    if not placement.is_measured:
        ruler = " The standoff need not be measured."
    if isinstance(target, CylinderTarget):
        aside = f"at x = {target.shift_mm:g} mm" if target.shift_mm else "on the optical axis"
        known = "" if target.diameter_sd_mm is None else f", known to {target.diameter_sd_mm:g} mm (1 sigma)"
        return (
            f" Its axis is vertical and {aside}; the standoff is that of its nearest line. Diameter"
            f" {target.diameter_mm:g} mm{known}.{ruler} {SPECULAR}"
        )
    if isinstance(target, FlatTarget) and target.turn_sd_deg is not None:
        return (
            f" {_nearer(target)} side is nearer; the standoff is that of its face on the optical axis."
            f" Set the angle to {target.turn_sd_deg:g} deg (1 sigma) by sine bar or digital level.{ruler}"
        )
    return ruler


def _nearer(target: FlatTarget) -> str:
    if abs(target.yaw_deg) >= abs(target.pitch_deg):
        return "Its left" if target.yaw_deg > 0 else "Its right"
    return "Its upper" if target.pitch_deg > 0 else "Its lower"


def _expected_sight(placement: Placement) -> str:
    if isinstance(placement.target, CylinderTarget):
        return "Every spot lies on the cylinder, and no beam is reflected towards a person or the camera."
    if isinstance(placement.target, WorldTarget):
        return "The vehicle stands on the floor, and its way is as in the world file."
    if isinstance(placement.target, BoardTarget) and _turn(placement):
        return "It is turned about as stated (the angle need not be measured), and every spot lies on it."
    if _turn(placement):
        return "It is turned as stated, and every spot lies on it."
    if not placement.is_measured:
        return "It faces the sensor, and every spot lies on it."
    return "Its face is square to the ruler, and every spot lies on it."


def _turn(placement: Placement) -> str:
    target = placement.target
    yaw, pitch = getattr(target, "yaw_deg", 0.0), getattr(target, "pitch_deg", 0.0)
    turns = [
        f"its {'right' if yaw > 0 else 'left'} side {abs(yaw):g} deg away" if yaw else "",
        f"its {'lower' if pitch > 0 else 'upper'} side {abs(pitch):g} deg away" if pitch else "",
    ]
    text = " and ".join(turn for turn in turns if turn)
    return f", {text}" if text else ""
