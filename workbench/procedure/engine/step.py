"""The protocol of a step, all that the engine knows of one, and the base class that most steps use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.prompts import placement_prompts

if TYPE_CHECKING:  # the context imports what a running step needs; files are checked without it
    from workbench.procedure.engine.context import Context

COMPUTING_S = 10.0
"""Duration of a step without captures where no session has measured it: computing, as a rule."""


class Step(Protocol):
    """One step of a procedure file: its keys, what it will do, and doing it.

    `name` is unique in a session (`calibrate-flat.3`) and begins the keys of the step's placements, captures
    and prompts.
    """

    needs: ClassVar[str | None]
    """What an earlier step must have given: `target`, `captures`, `fit`, `calibration`."""
    gives: ClassVar[str | None]
    """What later steps find."""

    @property
    def step(self) -> str:
        """Kind of the step, the tag in the file."""

    @property
    def title(self) -> str:
        """One line for people."""

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """Placements of the target, in the order in which they are asked for."""

    def captures(self, rig: Rig) -> int:
        """Number of captures at all placements together, but for those that only some readings need."""

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts that may come, so that an answers file can be checked before anything begins."""

    @property
    def default_duration_s(self) -> float:
        """Duration without placements and captures, where no session has measured it."""

    def run(self, context: Context, name: str) -> str:
        """Do it; returns the outcome in one line.

        Raises:
            WorkbenchError: the procedure cannot go on.
        """


class StepModel(FileModel):
    """Base of a step: no placements, no captures, prompts for the placements alone."""

    needs: ClassVar[str | None] = None
    gives: ClassVar[str | None] = None

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """None; see `Step`."""
        return ()

    def captures(self, rig: Rig) -> int:
        """None; see `Step`."""
        return 0

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Those of the placements; see `Step`."""
        return placement_prompts(self.placements(name, rig))

    @property
    def default_duration_s(self) -> float:
        """That of a computation; see `Step`."""
        return COMPUTING_S


def flat_placement(name: str, standoff_mm: float, number: int | None = None) -> Placement:
    """Placement of a flat target at a standoff, in the step `name`.

    A target that returns to a standoff needs the `number` of the placement: keys must differ.
    """
    # 12 digits: keys name files, so standoffs that differ must have keys that differ.
    turn = "" if number is None else f"{number:02d}-"
    return Placement(key=f"{name}/{turn}{standoff_mm:.12g}mm", standoff_mm=standoff_mm)
