"""Protocol of a step, which is all that the engine uses, and base class of steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.prompts import placement_prompts

if TYPE_CHECKING:  # checking a file must not import what a running step needs
    from workbench.procedure.engine.context import Context

COMPUTING_S = 10.0
"""Default duration of a step without captures: usually a computation."""


class Step(Protocol):
    """Step of a procedure file: its keys, its planned actions, and their execution.

    `name` is unique in a session (`calibrate-flat.3`); it is the prefix of the keys of the step's placements,
    captures and prompts.
    """

    needs: ClassVar[str | None]
    """Result that an earlier step must give: `target`, `captures`, `fit`, `calibration` or `readings`."""
    gives: ClassVar[str | None]
    """Result for later steps."""

    @property
    def writes(self) -> str | None:
        """File in the session folder that no other step may write; None: no such file."""

    @property
    def step(self) -> str:
        """Kind of the step: the tag in the file."""

    @property
    def title(self) -> str:
        """Title in one line."""

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """Placements of the target, in order."""

    def captures(self, rig: Rig) -> int:
        """Number of captures at all placements, without those that only ambiguous readings need."""

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Possible prompts, against which an answers file is checked before the session."""

    def added_prompts(self, name: str, rig: Rig, added_mm: Sequence[float]) -> Sequence[Prompt]:
        """Possible prompts of the placements at standoffs that repairs have added to this step."""

    @property
    def default_duration_s(self) -> float:
        """Duration without placements and captures, if no session has measured it."""

    def run(self, context: Context, name: str) -> str:
        """Run the step; returns the outcome in one line.

        Raises:
            WorkbenchError: the procedure cannot continue.
        """


class StepModel(FileModel):
    """Base class of steps: no placements, no captures, prompts only for placements."""

    needs: ClassVar[str | None] = None
    gives: ClassVar[str | None] = None

    @property
    def writes(self) -> str | None:
        """None; see `Step`."""
        return None

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """None; see `Step`."""
        return ()

    def captures(self, rig: Rig) -> int:
        """None; see `Step`."""
        return 0

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements; see `Step`."""
        return placement_prompts(self.placements(name, rig))

    def added_prompts(self, name: str, rig: Rig, added_mm: Sequence[float]) -> Sequence[Prompt]:
        """None; see `Step`."""
        return ()

    @property
    def default_duration_s(self) -> float:
        """Duration of a computation; see `Step`."""
        return COMPUTING_S


def flat_placement(name: str, standoff_mm: float, number: int | None = None) -> Placement:
    """Placement of a flat target at a standoff, in the step `name`.

    A step that returns to a standoff must state the `number` of the placement, so that keys differ.
    """
    # 12 digits keep the keys of different standoffs distinct; keys are parts of file names.
    prefix = "" if number is None else f"{number:02d}-"
    return Placement(key=f"{name}/{prefix}{standoff_mm:.12g}mm", standoff_mm=standoff_mm)
