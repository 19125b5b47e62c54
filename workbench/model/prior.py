"""Priors of parameters in a rig file, and their bounds."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from workbench.model.bounds import prior_within
from workbench.model.yamlfile import FileModel

LARGEST = 1e6
"""Largest accepted number of millimetres or pixels."""
SMALLEST_SD = 1e-9
"""Smallest accepted standard deviation of a prior other than 0."""


class Prior(FileModel):
    """Gaussian prior of a parameter: mean and standard deviation (1 sigma).

    `sd: 0` makes the parameter a constant of the fit.
    """

    value: Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
    sd: Annotated[float, Field(ge=0, le=LARGEST)]

    @field_validator("sd")
    @classmethod
    def _is_zero_or_large_enough(cls, sd: float) -> float:
        if 0 < sd < SMALLEST_SD:
            raise ValueError(f"expected 0 (known exactly) or at least {SMALLEST_SD:g}")
        return sd


def exactly(value: float) -> Prior:
    """Prior of a constant."""
    return Prior(value=value, sd=0.0)


Coefficient = Annotated[Prior, prior_within(-100, 100, 100, "no lens distorts so much")]
Baseline = Annotated[Prior, prior_within(-10_000, 10_000, 1000, "millimetres from the camera")]
Slope = Annotated[Prior, prior_within(-10, 10, 1, "tangent of the beam's angle to the optical axis")]
Scale = Annotated[Prior, prior_within(-0.5, 0.5, 0.5, "relative: 0.001 is one millimetre in a metre")]
Drift = Annotated[Prior, prior_within(-1000, 1000, 1000, "pixels over all captures")]
