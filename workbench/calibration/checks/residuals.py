"""Do the residuals look like noise? Tests against standoff, laser, u and v, order, and of their variance.

Fitted residuals are neither independent nor alike: parameters, placement errors and tilts have taken their
share. In standard deviations and under the rig file's priors, the residuals r of a fit have the covariance R
= 1 - J C J^T (J their derivatives by the parameters, C the posterior covariance: the measurements' own
covariance is 1 + J J^T, and R is its inverse).

A trend W (n x k) that the model lacks has the score W^T r with the covariance W^T R W; the square of the
whitened score is chi-square of as many degrees as W has directions that the parameters do not absorb (C. R.
Rao, Proc. Camb. Phil. Soc. 44 (1948) 50).

A quadratic form r^T B r (lag, variance) has the mean tr(B R), the variance 2 tr(B R B R) and the third
central moment 8 tr(B R B R B R); it is approximated by the gamma distribution with these
three (Pearson's type III).

Quadratic forms are taken with their mean at any size of the noise removed, and over that size as the
residuals show it: noise that is stated wrongly is told elsewhere, and is neither lag nor a difference.

Repeats of a spot share everything but their own noise: their deviations from their mean are tested by
themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from workbench.calibration.data.observations import positions, stated_sd
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.refit import Refit, measured, optimum_of, problem_of, refit
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.fit_event import ResidualTest
from workbench.model.stats import chi2_sf, gamma_cdf, gamma_sf, norm_cdf

FALSE_ALARM = 0.01
"""Of one sound fit: the chance that any of its residual tests raises an alarm."""
ABSORBED = 0.02
"""Directions of a trend of which the parameters leave less than this cannot be tested."""
SEEN_VARIANCE = 1e-3
"""Of a quadratic form, a degree of freedom, for it to be tested: two repeats of each spot, say, are always as
much apart as they are and have no lag."""
LEAST_NOISE = 1e-3
"""Residuals smaller than this part of their stated deviation are no noise: numbers copied, or made up."""
MOST_EQUAL = 0.5
"""Share of pairs of repeats with equal numbers. More are equal where positions are rounded to more than twice
their deviation: what is left of the noise then depends on where between two numbers a spot lies."""
FEWEST_FREE = 20
"""Degrees of freedom among repeats below which their tests are not made."""


def residual_tests(fit: CalibrationFit) -> tuple[ResidualTest, ...]:
    """Every test that the fit has data for."""
    spots = _Spots.of(fit)
    tests = (*_trends(spots, len(fit.rig.lasers)), *_of_spots(fit, spots), *_of_repeats(fit))
    return tuple(ResidualTest(name=name, p=p) for name, p in tests if np.isfinite(p))


def alarms(tests: tuple[ResidualTest, ...]) -> tuple[ResidualTest, ...]:
    """Those that say that something is wrong, with FALSE_ALARM for all together (Bonferroni)."""
    return tuple(test for test in tests if test.p < FALSE_ALARM / len(tests))


def explain(test: ResidualTest) -> str:
    """What an alarm means and what to do, for the person at the bench."""
    kind = max((name for name in _WORDS if test.name.startswith(name)), key=len)
    which = test.name.removeprefix(kind).removeprefix(": ")
    return f"{_WORDS[kind].format(which)} (by chance in 1 of {1 / max(test.p, 1e-12):.2g} sound fits)"


_WORDS = {
    "standoff": "residuals follow the standoff: check the ruler's zero and scale (bench.offset_mm,"
    " ruler_scale) and that the target stood square",
    "laser": "residuals follow the standoff differently for each laser: check that no laser moved in its"
    " mount and that the target is flat",
    "u": "residuals follow the place in the picture, left to right: the lens needs another distortion"
    " coefficient (camera.k3 or another one that the rig file holds constant), or the image is scaled",
    "v": "residuals follow the place in the picture, top to bottom: the lens needs another distortion"
    " coefficient (camera.k3 or another one that the rig file holds constant), or the image is scaled",
    "order": "residuals of successive captures are alike: something drifted; let sensor and lasers warm up,"
    " and repeat with the standoffs in another order",
    "variance over standoff": "residuals scatter more at one end of the standoffs than the other: state spot"
    " noise and speckle as they are there (u_sd_px, v_sd_px), or improve the exposure",
    "variance of u and v": "residuals scatter differently in u and v than stated: state u_sd_px and v_sd_px,"
    " and look at the spots' shape",
    "variance of laser": "residuals of laser {} scatter differently than the others': look at its spots "
    "(focus, speckle, a second mode)",
    "repeats: order": "successive repeats are alike: something moves or lags; wait longer after firing"
    " a laser (frames in flight) and after placing the target",
    "repeats: over standoff": "repeats scatter more at one end of the standoffs than the other: state u_sd_px"
    " and v_sd_px as they are there",
    "repeats: u and v": "repeats scatter differently in u and v than stated: state u_sd_px and v_sd_px",
    "repeats: laser": "repeats of laser {} scatter differently than the others': look at its mount and its"
    " supply",
}


@dataclass(frozen=True)
class _Spots:
    """Spots' measured coordinates, n of them, in the order of the captures."""

    residual: FloatArray
    """(n,) in standard deviations."""
    covariance: FloatArray
    """(n, n) of the residuals."""
    sd_px: FloatArray
    laser: IndexArray
    axis: IndexArray
    """0 for u, 1 for v."""
    outward: FloatArray
    """1 or -1 along the laser's axis, as its baseline points; 0 across."""
    distance: FloatArray
    """Logarithm of the standoff, from -1 to 1."""
    place: FloatArray
    """(n, 2) where the fit has the spot, -1 to 1 over the picture (where it was seen, its noise is too)."""

    @classmethod
    def of(cls, fit: CalibrationFit) -> _Spots:
        cells, problem = fit.cells, problem_of(fit)
        size = np.array([fit.rig.camera.width_px, fit.rig.camera.height_px])
        whole: Refit = refit(problem, measured(problem), optimum_of(fit), fit.noise_scale)
        rows = np.flatnonzero(measured(problem)[: 2 * len(cells.laser)])
        own = whole.jacobian[rows]
        laser, axis = cells.laser[rows // 2], rows % 2
        standoff = np.array([p.standoff_mm for p in cells.placements])[cells.placement]
        along = np.array(["uv".index(one.axis) for one in fit.rig.lasers])
        sign = np.array(
            [np.sign((one.x_mm if one.axis == "u" else one.y_mm).value) for one in fit.rig.lasers]
        )
        return cls(
            residual=whole.residual[rows],
            covariance=np.eye(len(rows)) - own @ whole.covariance @ own.T,
            sd_px=cells.sd_px.ravel()[rows],
            laser=laser,
            axis=axis,
            outward=np.where(along[laser] == axis, sign[laser], 0.0),
            distance=_spread(np.log(standoff))[rows // 2],
            place=(2 * whole.predicted_px / size - 1)[rows // 2],
        )

    def trend_p(self, pixels: FloatArray) -> float:
        """Chance of residuals that follow displacements (n, k) as much as these; NaN if none can be seen."""
        trend = pixels / self.sd_px[:, None]
        trend = trend[:, (trend**2).sum(axis=0) > 0]
        trend = trend / np.sqrt((trend**2).sum(axis=0))
        left, directions = np.linalg.eigh(trend.T @ self.covariance @ trend)
        seen = left > ABSORBED
        score = directions[:, seen].T @ (trend.T @ self.residual)
        return float(chi2_sf((score**2 / left[seen]).sum(), seen.sum())) if seen.any() else float("nan")

    def quadratic_p(self, weight: FloatArray) -> float:
        """Two-sided chance of r^T B r, B (n, n), whatever the size of the noise; NaN if it cannot vary."""
        freedom = float(np.trace(self.covariance))
        if freedom < 1 or self.residual @ self.residual < LEAST_NOISE**2 * freedom:
            return float("nan")
        weight = weight - np.trace(weight @ self.covariance) / freedom * np.eye(len(weight))
        noise2 = float(self.residual @ self.residual) / freedom
        product = weight @ self.covariance
        square = product @ product
        moments = np.trace(product), 2 * np.trace(square), 8 * np.trace(square @ product)
        value = float(self.residual @ weight @ self.residual) / noise2
        if moments[1] < SEEN_VARIANCE * freedom:
            return float("nan")
        return _two_sided(value, *map(float, moments))


def _trends(spots: _Spots, lasers: int) -> Iterator[tuple[str, float]]:
    over_standoff = legvander(spots.distance, 3)
    by_id = np.eye(lasers)[spots.laser]
    axes = np.eye(2)[spots.axis]
    by_laser = (by_id[:, :, None] * axes[:, None])[..., None] * over_standoff[:, None, None, 1:3]
    trends = {
        "standoff": spots.outward[:, None] * over_standoff,
        "laser": by_laser.reshape(len(axes), -1),
        "u": _by_axis(axes, legvander(spots.place[:, 0], 3)[:, 1:]),
        "v": _by_axis(axes, legvander(spots.place[:, 1], 3)[:, 1:]),
    }
    for name, pixels in trends.items():
        yield (name, spots.trend_p(pixels))


def _of_spots(fit: CalibrationFit, spots: _Spots) -> Iterator[tuple[str, float]]:
    order = np.zeros(spots.covariance.shape)
    for axis in (0, 1):
        mine = np.flatnonzero(spots.axis == axis)
        order[mine[:-1], mine[1:]] = order[mine[1:], mine[:-1]] = 0.5
    yield ("order", spots.quadratic_p(order))
    for name, weight in _contrasts(fit, spots.laser, spots.axis, spots.distance):
        yield (f"variance {name}", spots.quadratic_p(np.diag(weight)))


def _contrasts(
    fit: CalibrationFit, laser: IndexArray, axis: IndexArray, distance: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    """What a variance may differ by, as weights whose mean is 0."""
    candidates = [("over standoff", distance), ("of u and v", np.where(axis == 0, 1.0, -1.0))]
    if len(fit.rig.lasers) > 1:
        candidates += [
            (f"of laser: {i}", (laser == n).astype(float)) for n, i in enumerate(fit.rig.laser_ids)
        ]
    for name, weight in candidates:
        centred = weight - weight.mean()
        if np.ptp(centred) > 0:
            yield name, centred


def _of_repeats(fit: CalibrationFit) -> Iterator[tuple[str, float]]:
    """Deviations of the repeats from their means."""
    groups = [
        _Repeats.of(fit, cell, axis)
        for axis in (0, 1)
        if _share_equal(fit, axis) <= MOST_EQUAL
        for cell in range(len(fit.cells.laser))
    ]
    groups = [g for g in groups if len(g.deviation) > 1]
    free = np.array([len(g.deviation) - 1 for g in groups])
    square = np.array([g.deviation @ g.deviation for g in groups])
    if free.sum() < FEWEST_FREE or square.sum() < LEAST_NOISE**2 * free.sum():
        return
    noise2 = square.sum() / free.sum()
    mean = sum(g.lag_mean() for g in groups) / free.sum()
    value, variance, third = np.array([g.lag(mean) for g in groups]).sum(axis=0)
    if variance > SEEN_VARIANCE * free.sum():
        yield ("repeats: order", _two_sided(value / noise2, 0.0, variance, third))
    cells = np.array([g.cell for g in groups])
    distance = _spread(np.log([p.standoff_mm for p in fit.cells.placements]))[fit.cells.placement[cells]]
    words = {"over standoff": "over standoff", "of u and v": "u and v", "of laser": "laser"}
    for name, weight in _contrasts(fit, fit.cells.laser[cells], np.array([g.axis for g in groups]), distance):
        kind, _, which = name.partition(": ")
        centred = weight - (weight * free).sum() / free.sum()
        moments = 2 * (centred**2 * free).sum(), 8 * (centred**3 * free).sum()
        p = _two_sided(float((centred * square).sum() / noise2), 0.0, *map(float, moments))
        yield (f"repeats: {words[kind]}" + (f": {which}" if which else ""), p)


def _share_equal(fit: CalibrationFit, axis: int) -> float:
    """Of all pairs of repeats of a spot, those whose coordinates are the same number; 0 where none are."""
    equal = pairs = 0
    for members in fit.cells.members:
        value = positions(members)[:, axis]
        count = np.unique(value[np.isfinite(value)], return_counts=True)[1]
        equal += int((count * (count - 1)).sum())
        pairs += int(count.sum() * (count.sum() - 1))
    return equal / max(pairs, 1)


@dataclass(frozen=True)
class _Repeats:
    """One coordinate of the repeats of one spot."""

    cell: int
    axis: int
    deviation: FloatArray
    """(m,) from their mean, in standard deviations."""
    direction: FloatArray
    """(m,) unit vector that the mean has taken out."""

    @classmethod
    def of(cls, fit: CalibrationFit, cell: int, axis: int) -> _Repeats:
        members = fit.cells.members[cell]
        value = positions(members)[:, axis]
        seen = np.isfinite(value)
        inverse = 1.0 / (fit.cells.repeat_scale * stated_sd(members, fit.rig.noise)[seen, axis])
        norm = np.sqrt((inverse**2).sum()) if seen.any() else 1.0
        direction = inverse / norm
        white = value[seen] * inverse
        return cls(cell, axis, white - direction * (direction @ white), direction)

    def lag_mean(self) -> float:
        """Expected sum of products of neighbours."""
        return -float(self.direction[:-1] @ self.direction[1:])

    def lag(self, mean: float) -> tuple[float, float, float]:
        """Sum of products of neighbours less `mean` times that of squares: value, variance, third moment."""
        count = len(self.deviation)
        form = (np.eye(count, k=1) + np.eye(count, k=-1)) / 2 - mean * np.eye(count)
        product = form @ (np.eye(count) - np.outer(self.direction, self.direction))
        square = product @ product
        value = float(self.deviation @ form @ self.deviation)
        return value, 2 * float(np.trace(square)), 8 * float(np.sum(square * product.T))


def _by_axis(axes: FloatArray, powers: NDArray[np.floating]) -> FloatArray:
    return (axes[:, :, None] * powers[:, None]).reshape(len(axes), -1)


def _spread(values: NDArray[np.floating]) -> FloatArray:
    """Linearly to -1 .. 1, 0 where all are the same."""
    low, high = np.nanmin(values), np.nanmax(values)
    return np.asarray(
        np.nan_to_num((2 * values - low - high) / (high - low if high > low else np.inf)), np.float64
    )


def _two_sided(value: float, mean: float, variance: float, third: float) -> float:
    """Chance of a value as far out by the gamma distribution of these moments."""
    z, skew = (value - mean) / variance**0.5, third / variance**1.5
    if abs(skew) < 1e-3:
        return float(2 * norm_cdf(-abs(z)))
    shape = 4 / skew**2
    x = max(shape + np.sign(skew) * z * shape**0.5, 0.0)
    return float(2 * min(gamma_cdf(x, shape), gamma_sf(x, shape)))
