"""Looking through files before anybody stands at the bench: all that can be told, in one pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.devices.registry import bench_problems, has_bench
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.yamlfile import Document, Mistake, kind_of, line_of, read_document, refuse
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.registry import step_kinds


@dataclass(frozen=True)
class _Note(Mistake):
    """Worth knowing; no mistake, or not one of this file alone."""


def check_file(path: Path) -> list[str]:
    """What is worth knowing of a procedure or rig file that is right, a line each.

    Raises:
        BadInputError: it is wrong; one line for each mistake, with file and line, in the order of the file,
            and for each note.
    """
    document = read_document(path)
    kinds = [
        kind for kind in ("procedure", "rig") if isinstance(document.data, dict) and kind in document.data
    ]
    if len(kinds) != 1:
        raise BadInputError(
            f"{path}:1: expected a procedure or a rig, with one key of these names; this is"
            f" {kind_of(document.data)}"
        )
    look = _in_procedure if kinds == ["procedure"] else _in_rig
    found = [*document.doubled, *look(document)]
    if not all(isinstance(one, _Note) for one in found):
        refuse(path, (Mistake(n.line, f"note: {n.text}") if isinstance(n, _Note) else n for n in found))
    return [f"{path}:{note.line}: {note.text}" for note in found]


def _in_procedure(document: Document) -> Iterator[Mistake]:
    yield from document.mistakes(Procedure)
    steps = document.data.get("steps")
    if isinstance(steps, list):
        yield from _between_steps(document, steps)


def _between_steps(document: Document, steps: list[Any]) -> Iterator[Mistake]:
    """Steps that do not find what they need. One that is no known kind might have given anything."""
    known = step_kinds()
    kinds = [known.get(str(step.get("step"))) if isinstance(step, dict) else None for step in steps]
    made: set[str | None] = set()
    for index, kind in enumerate(kinds):
        if kind is None:
            return
        if (needs := kind.needs) is not None and needs not in made:
            line, where = line_of(document.data, ("steps", index)), f"steps[{index}]: {steps[index]['step']}"
            if any(later is not None and later.gives == needs for later in kinds[index:]):
                yield Mistake(line, f"{where} needs what gives {needs} before it, which comes after it")
            else:
                wanted = f"needs a procedure before this one, in the same call, that gives {needs}"
                yield _Note(line, f"{where} {wanted}")
            made.add(needs)
        made.add(kind.gives)


def _in_rig(document: Document) -> Iterator[Mistake]:
    of_rig = document.mistakes(Rig)
    yield from of_rig
    if not has_bench(document.data.get("driver"), document.data.get("devices")):
        yield _Note(1, "has no driver and no devices: it can be fitted but not run")
    rig = None if of_rig else Rig.model_validate(document.data)
    of_bench = map(document.mistake, bench_problems(document.data, rig))
    yield from (one for one in of_bench if one not in of_rig)
