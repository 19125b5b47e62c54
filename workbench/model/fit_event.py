"""Result of a fit as an event: parameters, residuals, cross-validation, faults, verdict."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

from workbench.model.calibration import TermSummary
from workbench.model.yamlfile import FileModel

REFUSING = (
    "lasers_swapped",
    "mirrored",
    "upside_down",
    "turned",
    "transposed",
    "unit",
    "standoff",
    "tilted",
    "moved",
    "never_lit",
)
"""Faults that invalidate the calibration; all others are notes."""


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
    placement: str | None = None
    """Key of the placement; None in sessions of versions that did not record it."""


@dataclass(frozen=True)
class Rejected:
    """A capture or row that the fit does not use."""

    source: str
    """`row 3` of a captures file, or the path of a frame."""
    reason: str


class LaserError(FileModel):
    """Range by one laser's spot, by the fit without the placement, minus the standoff.

    The standard deviation covers the fit without the placement, the placement itself, and the spot.
    """

    laser_id: str
    error_mm: float | None
    """None: the spot lies beyond where the laser's spot is at infinity."""
    sd_mm: float
    """1 sigma at the standoff."""


class CrossValidatedPlacement(FileModel):
    """Placement ranged by the fit without it; 1 sigma as that fit predicts it."""

    placement: str
    standoff_mm: float
    error_mm: float | None
    """Range by all spots of the placement - standoff; None: they lie beyond infinity."""
    sd_mm: float
    """1 sigma at the standoff."""
    lasers: tuple[LaserError, ...]
    """Empty on the printed board: its tilt is known from its corners alone, a single spot's range is not."""
    alarm: bool = False
    """Error larger than the predicted uncertainty explains; 1 of 1000 sound fits has any alarm."""
    chi2: float = 0.0
    """Squared distance of all spots from their prediction, by its covariance."""
    coordinates: int = 0
    """Degrees of freedom of `chi2`; 0 in sessions of versions that did not record it."""
    freedom: float | None = None
    """Degrees of freedom of the noise, estimated from the other placements; None: the noise is as stated."""

    score: float | None = None
    """Range error to first order in pixels, in predicted standard deviations; None where not recorded."""

    @property
    def z(self) -> float:
        """Range error in predicted standard deviations, to first order in pixels: normal at any range."""
        if self.score is not None:
            return self.score
        return inf if self.error_mm is None else self.error_mm / self.sd_mm

    @property
    def relative_error(self) -> float:
        """Magnitude of the range error relative to the standoff; to first order in pixels beyond infinity."""
        error_mm = self.z * self.sd_mm if self.error_mm is None else self.error_mm
        return abs(error_mm) / self.standoff_mm

    @property
    def alarm_test(self) -> Literal["range", "spots", ""]:
        """Test that raises the alarm, the less probable of both; empty without an alarm."""
        if not self.alarm:
            return ""
        return "range" if self.range_p <= self.spots_p else "spots"

    @property
    def range_p(self) -> float:
        """Two-sided p value of the range error: normal, or Student's t where the noise is estimated."""
        from workbench.model.stats import (
            norm_cdf,
            t_cdf,
        )  # loads scipy, which a list of sessions does not need

        tail = norm_cdf(-abs(self.z)) if self.freedom is None else t_cdf(-abs(self.z), self.freedom)
        return float(2 * tail)

    @property
    def spots_p(self) -> float:
        """P value of `chi2`: chi-square, or Fisher's F where the noise is estimated; 1 where not recorded."""
        from workbench.model.stats import chi2_sf, f_sf

        if not self.coordinates:
            return 1.0
        if self.freedom is None:
            return float(chi2_sf(self.chi2, self.coordinates))
        return float(f_sf(self.chi2 / self.coordinates, self.coordinates, self.freedom))


class Fault(FileModel):
    """Named cause of wrong data; docs/validation.md lists the names."""

    name: str
    message: str
    placement: str | None = None
    """Key of the placement that is wrong; None: no single one."""

    @property
    def refuses(self) -> bool:
        """Whether data with this fault give no calibration."""
        return self.name in REFUSING


class ResidualTest(FileModel):
    """Test of a fit's residuals, with the p value of its statistic under the stated noise."""

    name: str
    p: float


class FitFinished(FileModel):
    """A calibration has been fitted, accepted or not."""

    kind: Literal["fit_finished"] = "fit_finished"
    parameters: tuple[ParameterRecord, ...]
    residuals: tuple[ResidualRecord, ...]
    rms_px: float
    observations: int
    rejected: tuple[Rejected, ...]
    verdict: Literal["accepted", "refused"]
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    terms: tuple[TermSummary, ...] = ()
    left_out: tuple[CrossValidatedPlacement, ...] = ()
    """Cross-validation, one entry for each placement."""
    faults: tuple[Fault, ...] = ()
    residual_tests: tuple[ResidualTest, ...] = ()
    needs_standoffs: bool = False
    """Refused because a laser was seen at too few standoffs, or because ranges are too uncertain."""
    drift_px: tuple[float, float] | None = None
    """Largest change of the image over the session in u and v, by drift and steps between its parts; null in
    sessions of versions that did not record it."""

    @property
    def has_named_fault(self) -> bool:
        """Whether a named fault refuses the calibration; its other reasons are consequences."""
        return any(fault.refuses for fault in self.faults)

    @property
    def suspects(self) -> tuple[str, ...]:
        """Keys of the placements with a fault that refuses, or else of those with an alarm."""
        if self.has_named_fault:
            named = [f.placement for f in self.faults if f.refuses and f.placement is not None]
            return tuple(dict.fromkeys(named))
        return tuple(one.placement for one in self.left_out if one.alarm)
