"""Step `validate`: cross-validation, each placement of the last fit ranged by the fit without it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from pydantic import model_validator

from workbench.model.errors import BadInputError
from workbench.model.limit import Limit
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import check_fit, refuse_retry, result_limit_prompts
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


class ValidationLimits(FileModel):
    """Limits on the errors of cross-validation."""

    worst_relative_error: Limit | None = None
    """Limit on the largest |range - standoff| / standoff."""
    worst_z: Limit | None = None
    """Limit on the largest |range - standoff| / stated standard deviation."""

    _no_retry = model_validator(mode="after")(refuse_retry)


@register
class ValidateStep(StepModel):
    """Compare the errors of cross-validation (each placement ranged by the fit without it) with limits."""

    needs: ClassVar[str | None] = "fit"
    step: Literal["validate"]
    limits: ValidationLimits = ValidationLimits()

    @property
    def default_duration_s(self) -> float:
        """Time of a few comparisons: the fit step has made the fits."""
        return 1.0

    @property
    def title(self) -> str:
        """Description of the step."""
        return "Cross-validate the calibration"

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """One prompt per limit with `on_fail: ask`."""
        return result_limit_prompts(name, self.limits)

    def run(self, context: Context, name: str) -> str:
        """Check the limits; raises the errors of `check_fit`."""
        placements = context.cross_validation
        if not placements:
            raise BadInputError(f"step {name}: nothing to validate; expected a fit of 3 placements or more")
        worst_error = max(one.relative_error for one in placements)
        worst_z = max(abs(one.z) for one in placements)
        values = {"worst_relative_error": worst_error, "worst_z": worst_z}
        verdict = check_fit(context, name, values, self.limits)
        return (
            f"{counted(len(placements), 'placement')}, each ranged by the fit without it: error at most"
            f" {100 * worst_error:.2g} % and {worst_z:.2g} stated sd; {verdict}"
        )
