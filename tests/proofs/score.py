"""Errors against what was stated of them: coverage, size over the bound, bias."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray

COVERAGE = (0.93, 0.97)
"""Of a stated 95 % interval."""
RMS_OVER_BOUND = 1.05
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class Score:
    """How n errors compare with their stated deviation and the bound."""

    name: str
    n: int
    coverage: float
    rms_over_bound: float
    bias_sd: float
    """Mean of error over stated deviation."""
    sd: float
    """Median of the stated deviations, in the unit of the error."""

    @property
    def coverage_sd(self) -> float:
        """Binomial, of the coverage if it is 95 %."""
        return float(np.sqrt(0.95 * 0.05 / self.n))

    @property
    def ratio_sd(self) -> float:
        """Of the rms of n normal errors over its expectation."""
        return float(np.sqrt(0.5 / self.n))

    @property
    def misses(self) -> list[str]:
        """The limits that it does not keep, in words."""
        low, high = COVERAGE
        found = []
        if not low <= self.coverage <= high:
            found.append(f"{self.name}: coverage {100 * self.coverage:.2f} %, expected 93 - 97 %")
        if not self.rms_over_bound <= RMS_OVER_BOUND:
            found.append(f"{self.name}: rms over bound {self.rms_over_bound:.3f}, expected at most 1.05")
        return found

    def line(self) -> str:
        """A line of the table."""
        coverage, expected = 100 * self.coverage, 100 * self.coverage_sd
        return (
            f"{self.name:>14}{self.n:>8}{self.sd:>12.4g}{coverage:>10.2f} +- {expected:.2f}"
            f"{self.rms_over_bound:>11.3f} +- {self.ratio_sd:.3f}{self.bias_sd:>+10.3f} +- {self.n**-0.5:.3f}"
        )


HEADER = f"{'':>14}{'n':>8}{'stated sd':>12}{'coverage %':>18}{'rms / bound':>20}{'bias / sd':>20}"


def score(name: str, error: FloatArray, sd: FloatArray, bound_variance: FloatArray) -> Score:
    """Score errors (n,); those that are not finite do not exist (a spot out of the frame)."""
    there = np.isfinite(error)
    error, sd, bound_variance = error[there], sd[there], bound_variance[there]
    z = error / sd
    return Score(
        name=name,
        n=len(z),
        coverage=float((np.abs(z) <= NORMAL_95).mean()),
        rms_over_bound=float(np.sqrt((error**2).mean() / bound_variance.mean())),
        bias_sd=float(z.mean()),
        sd=float(np.median(sd)),
    )
