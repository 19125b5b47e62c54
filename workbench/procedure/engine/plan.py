"""Plan of a session: files, steps and prompts, read and checked before the bench is opened."""

from __future__ import annotations

import time
from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from workbench.devices.registry import check_driver, load_bench_rig
from workbench.model.errors import BadInputError
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.optics.emitters import emitter_problems
from workbench.procedure.engine.existing_calibration import GIVES, ExistingCalibration
from workbench.procedure.engine.procedure_file import Procedure, load_procedure
from workbench.procedure.engine.prompts import safety_prompt
from workbench.procedure.engine.step import Step


@dataclass(frozen=True)
class PlannedStep:
    """Step of a procedure with its numbers of placements and captures."""

    procedure: str
    index: int
    title: str
    placements: int
    captures: int
    default_duration_s: float = 10.0
    """Duration without captures, if no session has measured it."""


@dataclass(frozen=True)
class Plan:
    """Rig, and the procedures that run on it in one session."""

    rig: Rig
    rig_path: Path
    procedures: tuple[Procedure, ...]
    procedure_paths: tuple[Path, ...]
    calibration: ExistingCalibration | None = None
    """Calibration that the session uses instead of a fit of its own."""

    @classmethod
    def load(cls, rig_path: Path, procedure_paths: Sequence[Path], calibration: Path | None = None) -> Plan:
        """Read and check the files.

        Raises:
            BadInputError: a file is wrong.
        """
        procedures = tuple(load_procedure(path) for path in procedure_paths)
        rig = load_bench_rig(rig_path)
        existing = None if calibration is None else ExistingCalibration.load(calibration, rig)
        return cls.of(rig, rig_path, procedures, procedure_paths, existing)

    @classmethod
    def of(
        cls,
        rig: Rig,
        rig_path: Path,
        procedures: Sequence[Procedure],
        procedure_paths: Sequence[Path],
        calibration: ExistingCalibration | None = None,
    ) -> Plan:
        """Check a rig and procedures.

        Raises:
            BadInputError: a step lacks what it needs, exports a calibration beside an existing one, or writes
                another's file. Or two procedures have the same name, the driver is unknown, or spots of an
                emitter cannot be assigned.
        """
        names = [p.procedure for p in procedures]
        for path, name in zip(procedure_paths, names, strict=True):
            if names.count(name) > 1:
                raise BadInputError(
                    f"{path}: procedure: expected distinct names of procedures in one command, got {name}"
                    " more than once"
                )
        if calibration is not None:
            calibration.refuse_export(procedures, procedure_paths)
        _check_order(procedures, procedure_paths, set() if calibration is None else {GIVES})
        _check_placements(rig, procedures, procedure_paths)
        _check_written(procedures, procedure_paths)
        check_driver(rig)
        if (found := next(emitter_problems(rig), None)) is not None:
            raise found[1]
        return cls(rig, rig_path, tuple(procedures), tuple(procedure_paths), calibration)

    def new_session(self, sessions: Path) -> Path:
        """Folder of a new session, named by time and first procedure, with a number if it exists."""
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

    def prompts(self, added_mm: Sequence[float] = ()) -> dict[str, Prompt]:
        """Every possible prompt by its key, in order; an answers file may answer these.

        The final text of a prompt about a limit is known only when the limit fails; here it names the limit.

        Args:
            added_mm: standoffs that repairs have added.
        """
        found = [safety_prompt(self.rig)]
        for procedure in self.procedures:
            for index, step in enumerate(procedure.steps, start=1):
                name = procedure.step_name(index)
                found += step.prompts(name, self.rig)
                if takes_added(procedure.steps, index - 1):
                    found += step.added_prompts(name, self.rig, added_mm)
        return {prompt.key: prompt for prompt in found}


GRID, FIT = "capture_grid", "fit"
"""Kinds of the steps that take additional standoffs, and use them."""


def takes_added(steps: Sequence[Step], index: int) -> bool:
    """Whether a step is the last grid before a fit, which takes the standoffs that repairs add."""
    kinds = [step.step for step in steps[index:]]
    later = kinds[1 : kinds.index(FIT)] if FIT in kinds else []
    return kinds[:1] == [GRID] and FIT in kinds and GRID not in later


def _check_placements(rig: Rig, procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
    """Refuse a step with equal placement keys, by which captures are stored and replayed."""
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps, start=1):
            keys = [placement.key for placement in step.placements(procedure.step_name(index), rig)]
            if doubled := [key for key in keys if keys.count(key) > 1]:
                raise BadInputError(
                    f"{path}: steps[{index - 1}]: {step.step}: expected distinct placements, got"
                    f" {doubled[0].rpartition('/')[2]} more than once; take more readings there instead"
                )


def _check_written(procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
    """Refuse a step that would overwrite a file of an earlier step."""
    writers: dict[str, str] = {}
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps):
            if (file := step.writes) is None:
                continue
            where = f"{path}: steps[{index}]: {step.step}"
            if (first := writers.setdefault(file, where)) != where:
                raise BadInputError(
                    f"{where}: file: expected a file of its own, got {file}, which is that of {first};"
                    " name another file"
                )


def _check_order(procedures: Sequence[Procedure], paths: Sequence[Path], given: Set[str]) -> None:
    """Refuse a step whose requirement is neither `given` nor met by an earlier step or procedure."""
    made: set[str | None] = {*given}
    for path, procedure in zip(paths, procedures, strict=True):
        for index, step in enumerate(procedure.steps):
            if step.needs is not None and step.needs not in made:
                raise BadInputError(
                    f"{path}: steps[{index}]: {step.step} needs a step before it that gives {step.needs};"
                    " add one, or name a procedure with such a step before this one in the command"
                    + (", or an existing calibration by --calibration FILE" if step.needs == GIVES else "")
                )
            made.add(step.gives)
