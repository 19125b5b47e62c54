"""Decisions about placements of a session that has ended, by the names that a person uses."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.procedure.engine.plan import FIT, GRID, Plan
from workbench.session.repairs import repairs_of
from workbench.session.state import placement_captures, replaced_captures

if TYPE_CHECKING:
    from workbench.procedure.engine.run import Invocation


@dataclass(frozen=True)
class Repair:
    """Decisions as given; placements by key or standoff, such as `calibrate-flat.2/280mm` or `280`."""

    reason: str
    recapture: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    restore: tuple[str, ...] = ()
    add_mm: tuple[float, ...] = ()
    accept: bool = False
    """Whether a calibration that fails its limits is accepted."""

    def decided(self, plan: Plan, records: Sequence[ev.Record], caller: Invocation) -> ev.SessionRepaired:
        """Event of the repair.

        Args:
            plan: rig and procedures of the session.
            records: records of the session so far.
            caller: invocation of the repair.

        Raises:
            BadInputError: no decision, or two for one placement; a name of no placement or of several;
                nothing to restore; no grid to add to.
        """
        keys = placement_keys(plan, records)
        recapture, leave_out, restore = (
            tuple(find_placement(name, keys) for name in names)
            for names in (self.recapture, self.leave_out, self.restore)
        )
        chosen = [*recapture, *leave_out, *restore]
        if not (chosen or self.add_mm or self.accept):
            raise BadInputError(
                "repair: expected at least one of --recapture, --leave-out, --restore, --add, --accept"
            )
        if doubled := [key for key in chosen if chosen.count(key) > 1]:
            raise BadInputError(f"repair: expected one decision for each placement, got two for {doubled[0]}")
        out = {
            *repairs_of(records).left_out,
            *skipped_placements([r.event for r in records]),
            *replaced_captures(records),
        }
        if wrong := [key for key in restore if key not in out]:
            those = ", ".join(sorted(out)) or "none"
            raise BadInputError(
                f"repair: {wrong[0]} is neither left out, skipped nor captured again; those are: {those}"
            )
        fitted = [p for p in plan.procedures if {GRID, FIT} <= {step.step for step in p.steps}]
        if self.add_mm and len(fitted) != 1:
            names = ", ".join(procedure.procedure for procedure in fitted) or "none"
            raise BadInputError(
                f"repair: --add: expected one procedure with {GRID} and {FIT} in the session, got {names}"
            )
        return ev.SessionRepaired(
            operator=caller.operator,
            command=caller.command,
            created=caller.created,
            reason=self.reason,
            recapture=recapture,
            leave_out=leave_out,
            restore=restore,
            add_mm=self.add_mm,
            accept=self.accept,
        )


def placement_keys(plan: Plan, records: Sequence[ev.Record]) -> list[str]:
    """Keys of all placements of a session, in order: those of its procedures, then those that were added."""
    planned = [
        placement.key
        for procedure in plan.procedures
        for index, step in enumerate(procedure.steps, start=1)
        for placement in step.placements(procedure.step_name(index), plan.rig)
    ]
    placed = [r.event.placement.key for r in records if isinstance(r.event, ev.TargetPlaced)]
    return list(dict.fromkeys([*planned, *placed]))


def find_placement(name: str, keys: Sequence[str]) -> str:
    """Key of the placement that a person names.

    Args:
        name: key, its end, or the standoff in mm.
        keys: keys of all placements.

    Raises:
        BadInputError: no placement has this name, or several have.
    """
    if name in keys:
        return name
    place = name.strip().removesuffix("mm").strip()
    with suppress(ValueError):
        place = f"{float(place):.12g}"
    ends = (f"/{place}mm", f"-{place}mm", f"/{name}")
    found = [key for key in keys if key.endswith(ends)]
    if len(found) == 1:
        return found[0]
    if found:
        raise BadInputError(f"repair: several placements at {place} mm: {', '.join(found)}; name one of them")
    raise BadInputError(f"repair: no placement {name}; expected one of {', '.join(keys) or 'none'}")


def kept_captures(plan: Plan, records: Sequence[ev.Record], repair: Repair | None) -> dict[str, int]:
    """Captures that a resumption reads from disk, and does not take again.

    Args:
        plan: rig and procedures of the session.
        records: records of the session so far.
        repair: decisions of the resumption.

    Returns:
        Number of captures by the key of their complete placement.

    Raises:
        BadInputError: the repair names no placement of the session.
    """
    keys = placement_keys(plan, records)
    decided = repair or Repair("")
    again, out, back = (
        {find_placement(name, keys) for name in names}
        for names in (decided.recapture, decided.leave_out, decided.restore)
    )
    dropped = again | out | (repairs_of(records).left_out.keys() - back)
    found = {key: one for key, one in placement_captures(records).items() if one.complete}
    found |= {key: one for key, one in replaced_captures(records).items() if key in back}
    return {key: len(one.captures) for key, one in found.items() if key not in dropped}


def restored_frames(records: Sequence[ev.Record]) -> dict[str, list[ev.FrameRef]]:
    """Frames of the complete captures of each placement that a repair has restored."""
    captures = placement_captures(records)
    keys = {key for r in records if isinstance(r.event, ev.SessionRepaired) for key in r.event.restore}
    return {key: captures[key].frames for key in sorted(keys & captures.keys()) if captures[key].complete}


def skipped_placements(events: Sequence[ev.Event]) -> list[str]:
    """Keys of the placements that a person skipped, before or after their captures."""
    answers = {event.key: event.answer for event in events if isinstance(event, ev.Answered)}
    set_aside = [event.key for event in events if isinstance(event, ev.SetAside) and event.left_out]
    return [*(key for key, answer in answers.items() if answer.action == "skip"), *set_aside]
