"""Step `validate`: cross-validation, each placement of the last fit ranged by the fit without it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from pydantic import model_validator

from workbench.model.errors import BadInputError
from workbench.model.limit import Limit
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import check_fit, fit_limit_prompts, refuse_retry
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


class ValidationLimits(FileModel):
    """Limits on what the fits without one placement each predict of it."""

    worst_relative_error: Limit | None = None
    """Largest |range - standoff| / standoff."""
    worst_z: Limit | None = None
    """Largest |range - standoff| in its promised standard deviations."""

    _no_retry = model_validator(mode="after")(refuse_retry)


@register
class ValidateStep(StepModel):
    """Leave each placement of the last fit out in turn: is it ranged as well as promised?"""

    needs: ClassVar[str | None] = "fit"
    step: Literal["validate"]
    limits: ValidationLimits = ValidationLimits()

    @property
    def default_duration_s(self) -> float:
        """The fits were made by the fit step."""
        return 1.0

    @property
    def title(self) -> str:
        """What is done."""
        return "Validate on standoffs left out"

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """One for each limit that asks where it fails."""
        return fit_limit_prompts(name, self.limits)

    def run(self, context: Context, name: str) -> str:
        """Check; the errors of `check_fit`."""
        left_out = context.left_out
        if not left_out:
            raise BadInputError(f"step {name}: nothing to validate; expected a fit of 3 placements or more")
        worst_error = max(abs(one.error_mm) / one.standoff_mm for one in left_out)
        worst_z = max(abs(one.z) for one in left_out)
        values = {"worst_relative_error": worst_error, "worst_z": worst_z}
        verdict = check_fit(context, name, values, self.limits)
        return (
            f"{len(left_out)} placements, each ranged by a fit without it: to {100 * worst_error:.2g} % or"
            f" better, {worst_z:.2g} sd of what was promised at worst; {verdict}"
        )
