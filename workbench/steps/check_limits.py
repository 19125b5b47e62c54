"""Step `check_limits`: compare the last fit with limits."""

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
from workbench.procedure.engine.limits import check_fit, refuse_retry, result_limit_prompts
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


class FitLimits(FileModel):
    """Limits on a fit."""

    rms_px: Limit | None = None
    max_relative_range_sd: Limit | None = None
    noise_scale: Limit | None = None
    rejected: Limit | None = None

    _no_retry = model_validator(mode="after")(refuse_retry)


@register
class CheckLimitsStep(StepModel):
    """Compare the last fit with limits; with `on_fail: ask` the operator decides."""

    needs: ClassVar[str | None] = "fit"
    step: Literal["check_limits"]
    limits: FitLimits

    @property
    def default_duration_s(self) -> float:
        """Time of a few comparisons."""
        return 1.0

    @property
    def title(self) -> str:
        """Subject of the check."""
        return "Check the fit's limits"

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """One prompt per limit with `on_fail: ask`."""
        return result_limit_prompts(name, self.limits)

    def run(self, context: Context, name: str) -> str:
        """Check the limits; raises the errors of `check_fit`."""
        if context.accepted is None:
            raise BadInputError(f"step {name}: no fit to check; expected a fit step before it")
        ranger = context.accepted.laser_ranger
        return check_fit(context, name, ranger.fit.model_dump() | ranger.validity.model_dump(), self.limits)
