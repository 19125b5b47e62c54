"""What a fit says of itself: parameters, residuals, cross-validation, faults, verdict."""

from __future__ import annotations

from typing import Literal

from workbench.model.calibration import TermSummary
from workbench.model.yamlfile import FileModel


class ParameterRecord(FileModel):
    """One fitted parameter; standard deviations are 1 sigma."""

    name: str
    unit: str
    value: float
    sd: float
    prior_value: float
    prior_sd: float
    data_share: float
    determined_by: Literal["data", "joint", "prior"]


class ResidualRecord(FileModel):
    """Measured minus predicted position of one laser at one placement, mean of its repeats."""

    laser_id: str
    standoff_mm: float
    u_px: float | None
    v_px: float | None
    u_sd_px: float | None
    v_sd_px: float | None


class RejectedRecord(FileModel):
    """A capture or row that a fit left out."""

    source: str
    """`row 3` of a captures file, or the path of a frame."""
    reason: str


class LaserError(FileModel):
    """Range by one laser's spot at a placement left out, minus the standoff.

    The standard deviation is that of the fit without the placement, the placement itself, and the spot.
    """

    laser_id: str
    error_mm: float
    sd_mm: float


class LeftOutRecord(FileModel):
    """What the fit without one placement says of it; 1 sigma as promised."""

    placement: str
    standoff_mm: float
    error_mm: float
    """Range by all its spots - standoff."""
    sd_mm: float
    lasers: tuple[LaserError, ...]
    alarm: bool
    """Farther off than promised; one sound fit in 1000 has any."""


class Fault(FileModel):
    """Something wrong with a fit's data, by name; docs/validation.md lists the names."""

    name: str
    message: str


class ResidualTest(FileModel):
    """A test of a fit's residuals, and the chance of a value as far out if nothing is wrong."""

    name: str
    p: float


class FitFinished(FileModel):
    """A calibration has been fitted, accepted or not."""

    kind: Literal["fit_finished"] = "fit_finished"
    parameters: tuple[ParameterRecord, ...]
    residuals: tuple[ResidualRecord, ...]
    rms_px: float
    observations: int
    rejected: tuple[RejectedRecord, ...]
    verdict: Literal["accepted", "refused"]
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    terms: tuple[TermSummary, ...] = ()
    left_out: tuple[LeftOutRecord, ...] = ()
    """Cross-validation, a placement each."""
    faults: tuple[Fault, ...] = ()
    residual_tests: tuple[ResidualTest, ...] = ()
