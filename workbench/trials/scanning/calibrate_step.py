"""Step `calibrate_head`: calibrate a scanning head on a flat at known standoffs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import result_limit_prompts
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel, flat_placement
from workbench.trials.scanning.moves import check_reach
from workbench.trials.trial_step import ResultLimits

Angles = Annotated[tuple[float, ...], Field(min_length=2)]


class HeadLimits(ResultLimits):
    """Limits on the fit of a head; without a fit that keeps them there is no file of the head."""

    rms_px: Limit | None = None
    """Root mean square of the residuals of both coordinates."""
    noise_scale: Limit | None = None
    """Factor of the residuals on the stated noise, 1 where they agree."""


@register
class CalibrateHeadStep(StepModel):
    """Turn the head to each angle at each standoff of a flat, fit axis and encoder, write the head's file."""

    gives: ClassVar[str | None] = "head"
    step: Literal["calibrate_head"]
    standoffs_mm: Standoffs
    angles_deg: Angles
    """Readings of the encoder, in the order of the moves; begin near 0, where every spot is in the image."""
    repeats: Count = 3
    file: Annotated[str, Field(pattern=r"^head[A-Za-z0-9_.-]*\.yaml$")] = "head.yaml"
    """File of the calibrated head in the session folder; each such step of a session needs its own."""
    limits: HeadLimits = HeadLimits()

    @model_validator(mode="after")
    def _all_differ(self) -> CalibrateHeadStep:
        require_different(self.standoffs_mm, "repeats")
        if doubled := [angle for angle in self.angles_deg if self.angles_deg.count(angle) > 1]:
            raise ValueError(f"angles_deg: expected each angle once, got {doubled[0]:g} deg more than once")
        return self

    @property
    def writes(self) -> str | None:
        """The file of the head."""
        return self.file

    @property
    def title(self) -> str:
        """Numbers of standoffs and angles."""
        return (
            f"Calibrate the scanning head: {counted(len(self.standoffs_mm), 'standoff')},"
            f" {counted(len(self.angles_deg), 'angle')} each"
        )

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per standoff.

        Raises:
            BadInputError: the rig has no head, or it does not reach an angle.
        """
        check_reach(rig, self.angles_deg)
        return [
            flat_placement(name, standoff_mm).model_copy(update={"head_deg": 0.0})
            for standoff_mm in self.standoffs_mm
        ]

    def captures(self, rig: Rig) -> int:
        """Number of pairs at all angles and standoffs."""
        return len(self.standoffs_mm) * len(self.angles_deg) * self.repeats

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements and of limits."""
        return [*super().prompts(name, rig), *result_limit_prompts(name, self.limits)]

    def run(self, context: Context, name: str) -> str:
        """Capture, fit, and write the calibration of the head.

        Raises:
            LimitFailedError: the fit has no result, or a limit failed.
            WorkbenchError: see `visit_placements`.
        """
        # Imported here: checking a file must not import the fit.
        from workbench.trials.scanning.calibrate import calibrate

        return calibrate(context, name, self, self.placements(name, context.rig))
