"""Step `scan`: the shape of a target from a scan of the calibrated head."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Standoff
from workbench.model.head_spec import STEEPEST_DEG
from workbench.model.number_text import counted
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget, FlatTarget, Placement, PolynomialTarget
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.scanning.moves import check_reach

MOST_ANGLES = 10_000
ScanTarget = Annotated[FlatTarget | CylinderTarget | PolynomialTarget, Field(discriminator="shape")]
Angle = Annotated[float, Field(ge=-STEEPEST_DEG, le=STEEPEST_DEG)]


@register
class ScanStep(StepModel):
    """Turn the head over an arc; points with intervals, compared with the stated target."""

    needs: ClassVar[str | None] = "head"
    gives: ClassVar[str | None] = "readings"
    step: Literal["scan"]
    standoff_mm: Standoff
    target: ScanTarget = FlatTarget()
    from_deg: Angle
    to_deg: Angle
    step_deg: Annotated[float, Field(gt=0)]

    @model_validator(mode="after")
    def _is_an_arc(self) -> ScanStep:
        if self.from_deg >= self.to_deg:
            raise ValueError(f"to_deg: expected more than from_deg, {self.from_deg:g}, got {self.to_deg:g}")
        if (count := (self.to_deg - self.from_deg) / self.step_deg) > MOST_ANGLES:
            raise ValueError(f"step_deg: expected at most {MOST_ANGLES} angles, got {count:.0f}")
        return self

    @property
    def angles_deg(self) -> tuple[float, ...]:
        """Readings of the encoder, in the order of the moves."""
        count = int((self.to_deg - self.from_deg) / self.step_deg + 1e-9)
        return tuple(round(self.from_deg + n * self.step_deg, 9) for n in range(count + 1))

    @property
    def title(self) -> str:
        """Target and number of angles."""
        angles = counted(len(self.angles_deg), "angle")
        return f"Scan a {self.target.shape} at {self.standoff_mm:g} mm, {angles}"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """The placement of the target.

        Raises:
            BadInputError: the rig has no head, or it does not reach an angle.
        """
        check_reach(rig, self.angles_deg)
        # The exposure is set where the beam meets the target.
        middle_deg = self.angles_deg[len(self.angles_deg) // 2]
        key = f"{name}/{self.standoff_mm:.12g}mm"
        return [Placement(key=key, standoff_mm=self.standoff_mm, target=self.target, head_deg=middle_deg)]

    def captures(self, rig: Rig) -> int:
        """One pair per angle."""
        return len(self.angles_deg)

    def run(self, context: Context, name: str) -> str:
        """Scan, and write the points.

        Raises:
            BadInputError: no head was calibrated.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the geometry.
        from workbench.trials.scanning.scan import scan

        return scan(context, name, self, self.placements(name, context.rig))
