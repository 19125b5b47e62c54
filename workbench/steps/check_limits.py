"""Step `check_limits`: hold the last fit against limits."""

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


class FitLimits(FileModel):
    """Limits on a fit."""

    rms_px: Limit | None = None
    max_relative_range_sd: Limit | None = None
    noise_scale: Limit | None = None
    rejected: Limit | None = None

    _no_retry = model_validator(mode="after")(refuse_retry)


@register
class CheckLimitsStep(StepModel):
    """Hold the last fit against limits; `on_fail: ask` leaves it to the operator, with a reason."""

    needs: ClassVar[str | None] = "fit"
    step: Literal["check_limits"]
    limits: FitLimits

    @property
    def default_duration_s(self) -> float:
        """A few comparisons."""
        return 1.0

    @property
    def title(self) -> str:
        """What is checked."""
        return "Check the fit's limits"

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """One for each limit that asks where it fails."""
        return fit_limit_prompts(name, self.limits)

    def run(self, context: Context, name: str) -> str:
        """Check; the errors of `check_fit`."""
        if context.accepted is None:
            raise BadInputError(f"step {name}: nothing to check; expected a fit step before it")
        ranger = context.accepted.laser_ranger
        return check_fit(context, name, ranger.fit.model_dump() | ranger.validity.model_dump(), self.limits)
