"""Errors of all lasers at all placements of a verification, and how the parameters of the sensor move them.

The errors e (measured - expected) have the covariance V by calibration, ruler, tilts, placements and spots.
They are whitened by V^-1/2, in which every statistic of a verification is a projection. Errors are those of
inverse depths, in which a large change is linear, multiplied by the squared depth so that they are in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import PlacementCheck


@dataclass(frozen=True)
class LaserErrors:
    """Whitened errors: independent, of variance 1 while the calibration is valid."""

    scores: FloatArray
    """(r,) in standard deviations; r is the rank of their covariance."""
    by_parameter: FloatArray
    """(r, P) change of the scores with a change of the sensor's parameters."""

    @property
    def chi2(self) -> float:
        """Sum of the squared scores."""
        return float(self.scores @ self.scores)

    @property
    def probability(self) -> float:
        """P value of the errors of a valid calibration."""
        return float(chi2_sf(self.chi2, len(self.scores)))


def laser_errors(reference: Reference, checks: Sequence[PlacementCheck]) -> LaserErrors | None:
    """Errors of the lasers at all placements, whitened; None without any.

    Args:
        reference: ruler and rail.
        checks: placements; one whose distance is not measured has a large `reference_sd_mm`.
    """
    parts = [_at_placement(reference, check) for check in checks if len(check.laser_mm)]
    if not parts:
        return None
    errors, gradient = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    covariance = gradient @ reference.covariance @ gradient.T
    covariance += block_diag(*(own for _, _, own in parts))
    sd = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
    known = values > len(values) * np.finfo(float).eps * values[-1]
    whiten = (vectors[:, known] / np.sqrt(values[known])).T / sd
    parameters = gradient.shape[1] - len(reference.shared)
    return LaserErrors(whiten @ errors, whiten @ gradient[:, :parameters])


def _at_placement(reference: Reference, check: PlacementCheck) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors (n,), derivatives by the true parameters (n, P + 3), and covariance (n, n) by the placement."""
    expected_mm = check.true_mm(reference)
    ratio = (expected_mm + reference.offset_mm) / (check.laser_mm + reference.offset_mm)
    by_parameter = ratio[:, None] ** 2 * check.by_parameter
    # A shift of all ranges is ratio x shift, however large: an unmeasured standoff hides the pinhole's.
    by_parameter[:, reference.offset_column] /= ratio
    gradient = reference.gradient(by_parameter, ratio[:, None] * check.by_shared)
    place_mm = ratio[:, None] * check.place_mm
    own = np.diag((ratio**2 * check.spot_sd_mm) ** 2) + check.reference_sd_mm**2 * np.outer(ratio, ratio)
    own += reference.tilt_sd**2 * place_mm @ place_mm.T
    return ratio * (check.laser_mm - expected_mm), gradient, own
