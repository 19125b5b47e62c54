"""Agreement of the mean errors of one range with their stated uncertainty, over all standoffs.

The errors of one calibration, of the ruler's scale and of the tilt common to all placements affect
every standoff. The mean errors are therefore tested together, with their full covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot, inf, sqrt

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.trials.accuracy.ranges import RangeError, Sensitivities
from workbench.trials.errors import EXPANSION
from workbench.trials.reference import Reference, TiltEffect
from workbench.trials.statistics.bias import BiasTest, ErrorSources, bias_test, en_score
from workbench.trials.statistics.coverage import clopper_pearson, effective_number
from workbench.trials.statistics.error_budget import BudgetTest, ErrorBudget, budget_test
from workbench.trials.statistics.estimate import Estimate
from workbench.trials.statistics.linearity import Linearity, linearity
from workbench.trials.statistics.welch_satterthwaite import CombinedUncertainty, combine


@dataclass(frozen=True)
class Bench:
    """Constants of sensor and bench that the uncertainty of a mean error depends on."""

    parameter_covariance: FloatArray
    """(P, P) of the calibration's parameters."""
    scale_sd: float
    """Relative standard uncertainty of the ruler's scale."""


@dataclass(frozen=True)
class PlacementErrors:
    """Errors of one range at one placement, with at least one reading."""

    reference: Reference
    errors_mm: FloatArray
    """(n,) measured - true."""
    share_inside: float
    """Share of the readings whose 95 % interval contains the true range."""
    sensitivities: Sensitivities
    """Mean over the readings."""

    @classmethod
    def of(cls, reference: Reference, found: Sequence[RangeError]) -> PlacementErrors:
        """Errors of the readings at one placement."""
        return cls(
            reference,
            np.array([one.error_mm for one in found]),
            float(np.mean([one.is_inside for one in found])),
            Sensitivities(
                np.mean([one.sensitivities.by_parameter for one in found], axis=0),
                sqrt(float(np.mean([one.sensitivities.spot_sd_mm**2 for one in found]))),
                float(np.mean([one.sensitivities.speckle_share for one in found])),
                TiltEffect.mean([one.sensitivities.tilt for one in found]),
                sqrt(float(np.mean([one.sensitivities.shape_sd_mm**2 for one in found]))),
            ),
        )

    @property
    def mean_mm(self) -> float:
        """Mean error."""
        return float(self.errors_mm.mean())

    @property
    def true_mm(self) -> float:
        """True range."""
        return self.reference.true_mm(self.sensitivities.tilt)


@dataclass(frozen=True)
class Agreement:
    """Mean errors of one range at p placements with their uncertainty, p at least 1."""

    name: str
    """`closest`, `mean` or the id of a laser."""
    bench: Bench
    placements: tuple[PlacementErrors, ...]
    missing: int = 0
    """Number of readings without this range."""

    @cached_property
    def errors_mm(self) -> FloatArray:
        """(p,) mean errors."""
        return np.array([one.mean_mm for one in self.placements])

    @cached_property
    def true_mm(self) -> FloatArray:
        """(p,) true ranges."""
        return np.array([one.true_mm for one in self.placements])

    @property
    def readings(self) -> FloatArray:
        """(p,) number of readings."""
        return np.array([len(one.errors_mm) for one in self.placements], np.float64)

    @cached_property
    def noise_mm(self) -> FloatArray:
        """(p,) stated 1 sigma of one reading by the noise of its spots, without speckle."""
        return self._spot_sd_mm * np.sqrt(1.0 - self._speckle_share)

    @cached_property
    def speckle_mm(self) -> FloatArray:
        """(p,) stated 1 sigma by speckle, common to the readings of a placement."""
        return self._spot_sd_mm * np.sqrt(self._speckle_share)

    @cached_property
    def repeats(self) -> BudgetTest | None:
        """Observed variance of the repeats compared with the stated noise; None without repeats."""
        budgets = [
            ErrorBudget(float(one.errors_mm.var(ddof=1)), len(one.errors_mm) - 1, {"noise": noise_mm})
            for one, noise_mm in zip(self.placements, self.noise_mm.tolist(), strict=True)
            if len(one.errors_mm) > 1 and noise_mm > 0
        ]
        return budget_test(budgets) if budgets else None

    @cached_property
    def calibration(self) -> FloatArray:
        """(p, p) covariance by the calibration, mm2."""
        gradient = np.array([one.sensitivities.by_parameter for one in self.placements])
        return np.asarray(gradient @ self.bench.parameter_covariance @ gradient.T, np.float64)

    @cached_property
    def placement_mm(self) -> FloatArray:
        """(p,) 1 sigma by the placement with its tilt."""
        return np.array([one.reference.own_sd_mm(one.sensitivities.tilt) for one in self.placements])

    @cached_property
    def shape_mm(self) -> FloatArray:
        """(p,) 1 sigma by the choice between shapes, common to the readings of a placement."""
        return np.array([one.sensitivities.shape_sd_mm for one in self.placements])

    @cached_property
    def common_mm(self) -> FloatArray:
        """(p, 2) 1 sigma by the tilt common to all placements, signed."""
        return np.array([one.sensitivities.tilt.common_mm for one in self.placements])

    @cached_property
    def covariance(self) -> FloatArray:
        """(p, p) covariance of the mean errors by all sources, mm2."""
        return ErrorSources(
            standoffs_mm=self.true_mm,
            calibration=self.calibration,
            placement_mm=np.sqrt(self.placement_mm**2 + self.speckle_mm**2 + self.shape_mm**2),
            placements=np.ones(len(self.placements)),
            repeatability_mm=self._repeatability_mm,
            readings=self.readings,
            scale=self.bench.scale_sd,
            common_mm=self.common_mm,
        ).covariance()

    @property
    def u_mm(self) -> FloatArray:
        """(p,) standard uncertainty of each mean error."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def uncertainty(self) -> list[CombinedUncertainty]:
        """(p,) uncertainty of each mean error, expanded by its degrees of freedom (95 %)."""
        repeats = self._repeatability_mm / np.sqrt(self.readings)
        others = np.sqrt(np.maximum(np.diag(self.covariance) - repeats**2, 0.0))
        dof = self.repeats.degrees_of_freedom if self.repeats is not None and self._factor > 1 else inf
        return [combine(pair, [dof, inf]) for pair in np.stack([repeats, others], axis=1).tolist()]

    @cached_property
    def bias(self) -> BiasTest:
        """Test of all mean errors together."""
        return bias_test(self.errors_mm, self.covariance)

    @cached_property
    def en(self) -> list[float]:
        """(p,) E_n of each mean error, both uncertainties with k = 2."""
        scale_mm = self.bench.scale_sd * self.true_mm
        reference = np.sqrt(self.placement_mm**2 + (self.common_mm**2).sum(axis=1) + scale_mm**2)
        sensor = np.sqrt(np.maximum(self.u_mm**2 - reference**2, 0.0))
        return [
            en_score(error, 0.0, EXPANSION * own, EXPANSION * other)
            for error, own, other in zip(
                self.errors_mm.tolist(), sensor.tolist(), reference.tolist(), strict=True
            )
        ]

    @cached_property
    def coverage(self) -> Estimate:
        """Share of the readings in their 95 % interval, by placement, with its interval.

        The placements share the error of the calibration: the interval counts effective ones.
        """
        shares = np.array([one.share_inside for one in self.placements])
        number = effective_number(self.covariance / np.outer(self.u_mm, self.u_mm))
        low, high = clopper_pearson(float(shares.mean()) * number, number)
        return Estimate(float(shares.mean()), low, high, number)

    @cached_property
    def linearity(self) -> Linearity | None:
        """Linearity of the mean ranges; None with fewer than three true ranges."""
        if len(np.unique(self.true_mm)) < 3:
            return None
        return linearity(self.true_mm, self.true_mm + self.errors_mm)

    @cached_property
    def worst(self) -> int:
        """Index of the error that is largest relative to its uncertainty."""
        return int(np.argmax(np.abs(self.errors_mm) / self.u_mm))

    @cached_property
    def _spot_sd_mm(self) -> FloatArray:
        return np.array([one.sensitivities.spot_sd_mm for one in self.placements])

    @cached_property
    def _speckle_share(self) -> FloatArray:
        return np.array([one.sensitivities.speckle_share for one in self.placements])

    @property
    def _factor(self) -> float:
        """Observed / stated standard deviation of the repeats, not below 1."""
        return 1.0 if self.repeats is None else max(1.0, sqrt(self.repeats.ratio))

    @property
    def _repeatability_mm(self) -> FloatArray:
        """(p,) standard deviation of a reading within a placement, as stated or, if larger, as observed."""
        return self.noise_mm * self._factor


def budget_of(one: Agreement, index: int) -> ErrorBudget:
    """Budget of the mean error at one placement: its square (one degree of freedom) against all sources."""
    common_mm = hypot(*one.common_mm[index].tolist())
    return ErrorBudget(
        float(one.errors_mm[index]) ** 2,
        1.0,
        {
            "noise_mm": float(one.noise_mm[index] / sqrt(one.readings[index])),
            "speckle_mm": float(one.speckle_mm[index]),
            "calibration_mm": sqrt(float(one.calibration[index, index])),
            "placement_mm": float(one.placement_mm[index]),
            "shape_mm": float(one.shape_mm[index]),
            "common_tilt_mm": common_mm,
            "scale_mm": float(one.bench.scale_sd * one.true_mm[index]),
        },
    )
