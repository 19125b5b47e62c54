"""Coverage factor of the calibration's uncertainties: Student's, where few data estimated the noise.

The certificate states U with the coverage probability that k = 2 has for a normal distribution (GUM, JCGM
100:2008, annex G). A calibration scales the stated noise of spots, or the stated deviations of placements,
where its data show more; such an estimate has degrees of freedom. Everything else is taken as known.
"""

from __future__ import annotations

from math import hypot, inf, sqrt

from workbench.model.calibration import FitSummary
from workbench.trials.errors import EXPANSION_PROBABILITY
from workbench.trials.statistics.welch_satterthwaite import CombinedUncertainty, combine


def expanded_range(spot_sd: float, parameter_sd: float, fit: FitSummary) -> CombinedUncertainty:
    """Uncertainty of a range.

    The part of the parameters is a mixture of noise, placements and priors. It gets the smallest degrees of
    freedom of its estimates, which the formula of Welch and Satterthwaite never goes below. Parts that rest
    on one estimate of the noise are added before, because they are wrong by the same factor.

    Args:
        spot_sd: standard uncertainty by the noise of the spots in the reading.
        parameter_sd: standard uncertainty by the parameters of the calibration, in the same unit.
        fit: summary of the calibration.
    """
    noise, placements = _degrees_of_freedom(fit)
    if noise <= placements:
        return combine([hypot(spot_sd, parameter_sd)], [noise], EXPANSION_PROBABILITY)
    return combine([spot_sd, parameter_sd], [noise, placements], EXPANSION_PROBABILITY)


def expanded_parameter(sd: float, data_share: float, fit: FitSummary) -> CombinedUncertainty:
    """Uncertainty of a parameter: the data's share has the smallest degrees of freedom.

    Args:
        sd: standard deviation of the posterior.
        data_share: information share of the data; the rest is the prior, which is known.
        fit: summary of the calibration.
    """
    by_data, by_prior = sd * sqrt(data_share), sd * sqrt(1 - data_share)
    return combine([by_data, by_prior], [min(_degrees_of_freedom(fit)), inf], EXPANSION_PROBABILITY)


def is_recorded(fit: FitSummary) -> bool:
    """Whether the degrees of freedom of every estimate are recorded; earlier versions did not."""
    return (fit.noise_scale == 1 or fit.noise_degrees_of_freedom is not None) and (
        fit.placement_scale == 1 or fit.placement_degrees_of_freedom is not None
    )


def k_text(k: float, degrees_of_freedom: float | None) -> str:
    """Text of a coverage factor, with its degrees of freedom; None: infinite."""
    factor = f"k = {round(k, 2):g}"
    return factor if degrees_of_freedom is None else f"{factor}, nu = {degrees_of_freedom:.3g}"


def _degrees_of_freedom(fit: FitSummary) -> tuple[float, float]:
    """Degrees of freedom of the noise and of the placements; infinite where they are as stated."""
    return fit.noise_degrees_of_freedom or inf, fit.placement_degrees_of_freedom or inf
