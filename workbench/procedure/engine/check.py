"""Check of procedure, rig and world files before a session: all mistakes in one pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.devices.registry import bench_problems, has_bench
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.world import World
from workbench.model.yamlfile import Document, Mistake, include_files, kind_of, line_of, read_document
from workbench.procedure.engine.existing_calibration import GIVES
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.registry import step_kinds


@dataclass(frozen=True)
class _Note(Mistake):
    """Remark on a valid file, or on its use with other files."""


@dataclass(frozen=True)
class FileCheck:
    """Result of the check of one file: texts with file and line, in the order of the file."""

    mistakes: tuple[str, ...]
    notes: tuple[str, ...]


def check_file(path: Path) -> FileCheck:
    """Check a procedure, rig or world file.

    Raises:
        BadInputError: the file cannot be read, or is none of these.
    """
    document = read_document(path)
    checks = {"procedure": _in_procedure, "rig": _in_rig, "world": _in_world}
    kinds = [kind for kind in checks if isinstance(document.data, dict) and kind in document.data]
    if len(kinds) != 1:
        raise BadInputError(
            f"{path}:1: expected a procedure, a rig or a world, with one key of these names; got"
            f" {kind_of(document.data)}"
        )
    found = sorted([*document.doubled, *checks[kinds[0]](document)], key=lambda one: one.line)
    return FileCheck(
        mistakes=tuple(f"{path}:{one.line}: {one.text}" for one in found if not isinstance(one, _Note)),
        notes=tuple(f"{path}:{one.line}: {one.text}" for one in found if isinstance(one, _Note)),
    )


def _in_world(document: Document) -> Iterator[Mistake]:
    yield from document.mistakes(World)


def _in_procedure(document: Document) -> Iterator[Mistake]:
    include_files(document, Procedure)
    yield from document.mistakes(Procedure)
    steps = document.data.get("steps")
    if isinstance(steps, list):
        yield from _between_steps(document, steps)


def _between_steps(document: Document, steps: list[Any]) -> Iterator[Mistake]:
    """Steps whose requirement no earlier step meets; ends at a step of unknown kind, which might meet it."""
    known = step_kinds()
    kinds = [known.get(str(step.get("step"))) if isinstance(step, dict) else None for step in steps]
    made: set[str | None] = set()
    for index, kind in enumerate(kinds):
        if kind is None:
            return
        if (needs := kind.needs) is not None and needs not in made:
            line, where = line_of(document.data, ("steps", index)), f"steps[{index}]: {steps[index]['step']}"
            if any(later is not None and later.gives == needs for later in kinds[index:]):
                yield Mistake(line, f"{where} needs a step before it that gives {needs}, got one after it")
            else:
                wanted = f"needs an earlier procedure in the same command that gives {needs}"
                if needs == GIVES:
                    wanted += ", or an existing one by --calibration FILE"
                yield _Note(line, f"{where} {wanted}")
            made.add(needs)
        made.add(kind.gives)


def _in_rig(document: Document) -> Iterator[Mistake]:
    include_files(document, Rig)
    of_rig = document.mistakes(Rig)
    yield from of_rig
    if not has_bench(document.data.get("driver"), document.data.get("devices")):
        yield _Note(1, "no driver and no devices: the rig can be fitted but not run")
    if not of_rig and not document.data.get("lasers"):
        yield _Note(1, "no lasers: only its camera can be fitted, to views of its board")
    rig = None if of_rig else Rig.model_validate(document.data)
    if rig is not None and any(len(together) > 1 for together in rig.emitters):
        # Imported here: only rays of several beams need JAX, which takes long to load.
        from workbench.optics.emitters import emitter_problems

        for index, error in emitter_problems(rig):
            line = line_of(document.data, ("lasers", index, "emitter"))
            yield Mistake(line, f"lasers[{index}].emitter: {error}")
    of_bench = map(document.mistake, bench_problems(document.data, rig))
    yield from (one for one in of_bench if one not in of_rig)
