"""Evidence for the terms of the model, each compared with its absence; no term is dropped.

A term is compared with its absence by a chi-square test of the data alone, and by the Bayes factor of the
two nested models. The latter is the Savage-Dickey ratio: posterior over prior density, both Gaussian, at
the value that means absence (J. M. Dickey and B. P. Lientz, Ann. Math. Statist. 41 (1970) 214). Dropping
terms has no benefit: ranges change by at most 0.03 of their standard deviation, and coverage does not
improve (docs/decisions/0005).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log
from typing import NamedTuple

import numpy as np

from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit_cells
from workbench.calibration.model.parameters import DRIFT
from workbench.calibration.selection.camera_fit import with_scatter_of_views
from workbench.calibration.selection.drift import drift_is_shown, fit_with_drift, with_drift
from workbench.calibration.selection.missing_terms import LEAST_INFORMATION, freed, missing_terms
from workbench.calibration.selection.outliers import fit_without_outliers, without_outliers
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import TermSummary, TermVerdict
from workbench.model.fit_event import Rejected
from workbench.model.nested import TILTS
from workbench.model.rig import TARGET_TILT, Rig
from workbench.model.stats import chi2_sf
from workbench.optics.image import in_picture
from workbench.sensor.range_model import RangeModel

STRONG = 1.0
"""log10 of a Bayes factor that is strong evidence (R. E. Kass and A. E. Raftery, JASA 90 (1995) 773)."""
GRID = 12
"""Standoffs at which the shift of ranges is evaluated."""


class _Comparison(NamedTuple):
    """The model with a term of T parameters against the model without it."""

    p_value: float
    log10_bayes_factor: float
    change: FloatArray
    """(P,) change of all parameters when the term is removed."""


def fit_calibration(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """`fit` without outliers, with the evidence for each term of the model in `terms`.

    Args:
        rig: priors and noise. Its constant terms are freed where the data call for them (`verdict`
            "called for"), so that spots that need the term are not rejected as outliers.
        observations: as for `fit`.
        rejected: as for `fit`.
        boards: as for `fit`.

    Raises:
        BadInputError: as `fit`.
        LimitFailedError: as `fit`.
    """
    boards = with_scatter_of_views(rig, boards)
    # Tested before any rejection: spots that need a missing term look like outliers.
    whole = fit_with_drift(rig, observations, rejected, boards)
    rig = whole.rig
    missing = missing_terms(whole)
    if missing:
        freer = freed(rig, [term.name for term in missing])
        sound = fit_without_outliers(freer, observations, rejected, boards)
        fitted = fit_cells(rig, sound.cells, sound.rejected, boards)
    else:
        fitted = without_outliers(whole, rejected)
    if fitted is not whole and drift_is_shown(fitted):  # which outliers may have hidden
        fitted = fit_cells(with_drift(rig), fitted.cells, fitted.rejected, boards)
    if fitted is not whole:
        missing = missing_terms(fitted)
    terms = [_weigh(fitted, name) for name in _candidates(fitted)]
    return replace(fitted, terms=(*terms, *missing))


def _weigh(fitted: CalibrationFit, name: str) -> TermSummary:
    """Evidence for a term against its absence."""
    index = _indices(fitted, name)
    one = _compare(fitted, index)
    verdict: TermVerdict = "open"
    if abs(one.log10_bayes_factor) >= STRONG:
        verdict = "shown" if one.log10_bayes_factor > 0 else "unneeded"
    return TermSummary(
        name=name,
        verdict=verdict,
        p_value=one.p_value,
        log10_bayes_factor=one.log10_bayes_factor,
        range_shift_sd=_range_shift_sd(fitted, one),
    )


def _candidates(fitted: CalibrationFit) -> list[str]:
    """Names of the terms of a fit, the highest order first."""
    names = {p.name for p in fitted.table.parameters if p.prior.sd > 0}
    orders = (*fitted.layout.model.terms, "ruler_scale", " ".join(TARGET_TILT), " ".join(DRIFT))
    found = [there for term in orders if (there := " ".join(n for n in term.split() if n in names))]
    return [*found, TILTS] if len(_indices(fitted, TILTS)) else found


def _indices(fitted: CalibrationFit, name: str) -> IndexArray:
    """(T,) indices of the parameters of a term."""
    wanted = set(name.split())
    if TILTS in wanted:
        boards = {view.placement.key for view in fitted.boards}
        flat = [p.key for p in fitted.cells.placements if p.key not in boards]
        wanted |= {f"{key}.{slope}" for key in flat for slope in ("slope_x", "slope_y")}
    return np.flatnonzero([p.name in wanted and p.prior.sd > 0 for p in fitted.table.parameters])


def _compare(fitted: CalibrationFit, index: IndexArray) -> _Comparison:
    """Compare a fit with its restriction to zero offset of the parameters `index`, to first order.

    Let y be the offsets in prior deviations and C their posterior covariance. The log Bayes factor is
    `(y C^-1 y + ln det C) / 2`. The data alone have the information `C^-1 - 1` and the score `C^-1 y`.
    """
    prior_sd = fitted.table.prior_sd[index]
    offset = fitted.values[index] - fitted.table.prior_mean[index]
    posterior = fitted.covariance[np.ix_(index, index)]
    follow = np.asarray(np.linalg.solve(posterior, fitted.covariance[index]).T, float)
    y, covariance = offset / prior_sd, posterior / np.outer(prior_sd, prior_sd)
    precision = np.linalg.inv(covariance)
    log_factor = 0.5 * (y @ precision @ y + np.linalg.slogdet(covariance)[1])
    return _Comparison(
        p_value=_p_value(precision @ y, precision - np.eye(len(y))),
        log10_bayes_factor=float(log_factor / log(10)),
        change=-follow @ offset,
    )


def _p_value(score: FloatArray, information: FloatArray) -> float:
    """P value of a score by its information (chi-square over the directions that the data constrain)."""
    values, vectors = np.linalg.eigh(information)
    known = values > LEAST_INFORMATION
    chi2 = ((vectors.T @ score)[known] ** 2 / values[known]).sum()
    return float(chi2_sf(chi2, known.sum())) if known.any() else 1.0


def _range_shift_sd(fitted: CalibrationFit, comparison: _Comparison) -> float:
    """Largest shift of any range without the term, in standard deviations of that range."""
    gradient, own_sd = _range_gradients(fitted)
    sd = np.sqrt(np.einsum("np,pq,nq->n", gradient, fitted.covariance, gradient) + own_sd**2)
    return float((np.abs(gradient @ comparison.change) / sd).max(initial=0.0))


def _range_gradients(fitted: CalibrationFit) -> tuple[FloatArray, FloatArray]:
    """Derivatives of ln(range) by all parameters (n, P), and relative sd by the spot's noise (n,).

    Over all lasers and a grid of standoffs, where the spot is in the image.
    """
    standoffs = [s.standoff_mm for s in fitted.used]
    grid = np.geomspace(min(standoffs), max(standoffs), GRID)
    noise = fitted.rig.noise
    spot_px = float(np.hypot(noise.spot_sd_px, noise.speckle_sd_px)) * fitted.noise_scale
    laser = np.repeat(np.arange(len(fitted.rig.lasers)), GRID)
    range_mm = np.tile(grid, len(fitted.rig.lasers))
    layout = fitted.layout
    spots = fitted.curves.spots(laser, 1.0 / (range_mm + fitted.values[layout.offset]))
    own = np.array([layout.own(n) for n in range(layout.lasers)])
    offset = layout.offset
    model = RangeModel(fitted.curves, float(fitted.values[offset]), own, offset, fitted.covariance)
    found = model.expected(laser, range_mm, np.full(spots.shape, spot_px))
    size = fitted.rig.camera.width_px, fitted.rig.camera.height_px
    seen = in_picture(spots, size) & np.isfinite(found.spot_sd_mm)
    return found.by_parameter[seen] / range_mm[seen, None], found.spot_sd_mm[seen] / range_mm[seen]
