"""What is about to run, read and checked before anything is switched on: files, steps, prompts."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.devices.registry import check_driver, load_bench_rig
from workbench.model.errors import BadInputError
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.procedure.engine.procedure_file import Procedure, load_procedure
from workbench.procedure.engine.prompts import safety_prompt


@dataclass(frozen=True)
class PlannedStep:
    """One step of a procedure."""

    procedure: str
    index: int
    title: str
    placements: int
    captures: int
    default_duration_s: float = 10.0
    """Where it takes no captures, and no session has measured it."""


@dataclass(frozen=True)
class Plan:
    """A rig and the procedures that run on it in one session."""

    rig: Rig
    rig_path: Path
    procedures: tuple[Procedure, ...]
    procedure_paths: tuple[Path, ...]

    @classmethod
    def load(cls, rig_path: Path, procedure_paths: Sequence[Path]) -> Plan:
        """Read the files.

        Raises:
            BadInputError: one of them is wrong.
        """
        procedures = tuple(load_procedure(path) for path in procedure_paths)
        return cls.of(load_bench_rig(rig_path), rig_path, procedures, procedure_paths)

    @classmethod
    def of(
        cls, rig: Rig, rig_path: Path, procedures: Sequence[Procedure], procedure_paths: Sequence[Path]
    ) -> Plan:
        """Check what was read.

        Raises:
            BadInputError: steps do not find what they need, two procedures have one name, no such driver.
        """
        names = [p.procedure for p in procedures]
        for path, name in zip(procedure_paths, names, strict=True):
            if names.count(name) > 1:
                raise BadInputError(
                    f"{path}: procedure: expected a name that no other procedure of this call has, got {name}"
                )
        _check_order(procedures, procedure_paths)
        _check_placements(rig, procedures, procedure_paths)
        check_driver(rig)
        return cls(rig, rig_path, tuple(procedures), tuple(procedure_paths))

    def new_session(self, sessions: Path) -> Path:
        """A folder name that sorts by time and says what was run; with a number where it is taken."""
        stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime())
        base = sessions / f"{stamp}-{self.procedures[0].procedure}"
        taken = (base.with_name(f"{base.name}-{n}") for n in range(2, 1000))
        return base if not base.exists() else next(path for path in taken if not path.exists())

    def steps(self) -> list[PlannedStep]:
        """Every step of every procedure, in order."""
        return [
            PlannedStep(
                procedure.procedure,
                index,
                step.title,
                len(step.placements(procedure.step_name(index), self.rig)),
                step.captures(self.rig),
                step.default_duration_s,
            )
            for procedure in self.procedures
            for index, step in enumerate(procedure.steps, start=1)
        ]

    def prompts(self) -> dict[str, Prompt]:
        """Every prompt that may come, by its key, in order: what an answers file can answer.

        The text of a prompt about a limit is known only when the limit fails; here it names the limit.
        """
        found = [safety_prompt(self.rig)]
        for procedure in self.procedures:
            for index, step in enumerate(procedure.steps, start=1):
                found += step.prompts(procedure.step_name(index), self.rig)
        return {prompt.key: prompt for prompt in found}


def _check_placements(rig: Rig, procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
    """Placements of a step have keys that differ: captures are stored and resumed by them."""
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps, start=1):
            keys = [placement.key for placement in step.placements(procedure.step_name(index), rig)]
            if doubled := [key for key in keys if keys.count(key) > 1]:
                raise BadInputError(
                    f"{path}: steps[{index - 1}]: {step.step}: expected placements that differ, got"
                    f" {doubled[0].rpartition('/')[2]} more than once; take more readings there instead"
                )


def _check_order(procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
    """Every step finds what it needs made by an earlier one, of its own or an earlier procedure."""
    made: set[str | None] = set()
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps):
            if step.needs is not None and step.needs not in made:
                raise BadInputError(
                    f"{path}: steps[{index}]: {step.step} needs a step before it that gives {step.needs};"
                    " add one, or give a procedure that has one before this in the same call"
                )
            made.add(step.gives)
