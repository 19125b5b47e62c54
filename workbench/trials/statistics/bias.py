"""Bias of a sensor over standoffs, tested with the full covariance of the errors, and the score E_n.

Errors of one calibration, and the scale of one ruler, are common to all standoffs. Their mean errors are
tested together; standoffs are not independent trials.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from workbench.model.arrays import FloatArray
from workbench.trials.statistics.estimate import require


@dataclass(frozen=True)
class ErrorSources:
    """Independent sources of the mean errors at p standoffs; standard uncertainties in mm."""

    standoffs_mm: FloatArray
    """(p,) true ranges, mm."""
    calibration: FloatArray
    """(p, p) covariance of the ranges by the calibration, mm2."""
    placement_mm: FloatArray
    """(p,) standard uncertainty of one placement, with speckle, mm."""
    placements: FloatArray
    """(p,) number of placements."""
    repeatability_mm: FloatArray
    """(p,) standard deviation of a reading within a placement, mm."""
    readings: FloatArray
    """(p,) number of readings at all placements."""
    scale: float = 0.0
    """Relative standard uncertainty of the reference scale (ruler)."""
    common_mm: FloatArray | None = None
    """(p, m) standard uncertainties by m further sources, each common to all standoffs, mm; None: none."""

    def covariance(self) -> FloatArray:
        """(p, p) covariance of the mean errors, mm2."""
        own = self.placement_mm**2 / self.placements + self.repeatability_mm**2 / self.readings
        ruler = self.scale * self.standoffs_mm
        common = 0.0 if self.common_mm is None else self.common_mm @ self.common_mm.T
        return np.asarray(self.calibration + np.diag(own) + np.outer(ruler, ruler) + common, np.float64)


@dataclass(frozen=True)
class BiasTest:
    """Test that p mean errors are zero."""

    z: FloatArray
    """(p,) each mean error / its standard uncertainty; they are correlated."""
    chi2: float
    degrees_of_freedom: int
    probability: float
    """Probability of a larger chi2 for a sensor without bias."""


def bias_test(errors_mm: FloatArray, covariance: FloatArray) -> BiasTest:
    """Test mean errors (p,) mm against zero with their covariance (p, p) mm2.

    Directions in which the covariance is zero to rounding are not tested.

    Raises:
        TooFewReadingsError: there is no error.
    """
    require(len(errors_mm), 1, "standoffs with readings")
    sd = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
    tested = values > len(values) * np.finfo(float).eps * values[-1]
    score = (vectors.T @ (errors_mm / sd))[tested] / np.sqrt(values[tested])
    total, dof = float(score @ score), int(tested.sum())
    return BiasTest(np.asarray(errors_mm / sd, np.float64), total, dof, float(chi2.sf(total, dof)))


def en_score(
    measured_mm: float, reference_mm: float, expanded_mm: float, reference_expanded_mm: float
) -> float:
    """E_n = abs(x - X) / sqrt(U^2 + U_ref^2), both U with k = 2; agreement if E_n <= 1 (ISO/IEC 17043).

    Raises:
        ValueError: both uncertainties are zero.
    """
    spread = float(np.hypot(expanded_mm, reference_expanded_mm))
    if not spread > 0:
        raise ValueError("expected an expanded uncertainty above 0 mm, got 0 for both")
    return abs(measured_mm - reference_mm) / spread
