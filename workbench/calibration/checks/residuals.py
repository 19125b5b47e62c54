"""Tests of the residuals for trends, autocorrelation, and unequal variances.

Fitted residuals are neither independent nor of equal variance: parameters, placement errors and tilts absorb
part of them. Let r be the residuals in standard deviations, J their derivatives by the parameters, C the
posterior covariance. Under the rig file's priors, r has the covariance R = 1 - J C J^T. (The
covariance of the measurements is 1 + J J^T, and R is its inverse.)

A trend W (n x k) that the model lacks has the score `W^T r` with the covariance `W^T R W`. The square of the
whitened score is chi-square. Its degrees of freedom are the number of directions of W that the parameters
do not absorb (C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50).

A quadratic form r^T B r (lag, variance) has the mean `tr(B R)`, the variance `2 tr(B R B R)` and the third
central moment `8 tr(B R B R B R)`. It is approximated by the gamma distribution with these three moments
(Pearson's type III). B is centred so that its mean vanishes at any noise level, and the form is divided by
the noise level of the residuals. A wrong stated noise is tested elsewhere; it must not appear as lag or as a
difference of variances.

Repeats of a spot share everything but their own noise: their deviations from their mean are tested
separately.
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
from workbench.optics.rows import axes_of, rays_of_rig

FALSE_ALARM = 0.01
"""Probability that any residual test of a sound fit raises an alarm."""
ABSORBED = 0.02
"""Least share of a trend's direction that the parameters must not absorb for it to be tested."""
SEEN_VARIANCE = 1e-3
"""Least variance of a quadratic form for each degree of freedom; two repeats of each spot, for example, have
no lag that could vary."""
LEAST_NOISE = 1e-3
"""Ratio of residuals to stated deviation below which they are not noise but copied or invented numbers."""
MOST_EQUAL = 0.5
"""Largest share of equal pairs among repeats. More are equal where positions are rounded to more than twice
their deviation; the scatter that remains then depends on where a spot lies between two rounded values."""
FEWEST_FREE = 20
"""Least degrees of freedom among repeats for their tests."""


def residual_tests(fit: CalibrationFit) -> tuple[ResidualTest, ...]:
    """All tests for which the fit has data."""
    spots = _Spots.of(fit)
    tests = (*_trends(spots, len(fit.rig.lasers)), *_of_spots(fit, spots), *_of_repeats(fit))
    return tuple(ResidualTest(name=name, p=p) for name, p in tests if np.isfinite(p))


def alarms(tests: tuple[ResidualTest, ...]) -> tuple[ResidualTest, ...]:
    """The tests with an alarm, at the rate FALSE_ALARM for all together (Bonferroni)."""
    return tuple(test for test in tests if test.p < FALSE_ALARM / len(tests))


def explain(test: ResidualTest) -> str:
    """Text of an alarm: meaning, remedy, p value."""
    kind = max((name for name in _TEXTS if test.name.startswith(name)), key=len)
    which = test.name.removeprefix(kind).removeprefix(": ")
    return f"{_TEXTS[kind].format(which)} (by chance in 1 of {1 / max(test.p, 1e-12):.2g} sound fits)"


_TEXTS = {
    "standoff": "residuals depend on the standoff: check zero and scale of the ruler (bench.offset_mm,"
    " ruler_scale) and that the target stands square",
    "laser": "residuals depend on the standoff differently for each laser: check that no laser moved in its"
    " mount and that the target is flat",
    "u": "residuals depend on u: the lens needs another distortion coefficient (camera.k3, or another that"
    " the rig file holds constant), or the image is scaled",
    "v": "residuals depend on v: the lens needs another distortion coefficient (camera.k3, or another that"
    " the rig file holds constant), or the image is scaled",
    "order": "residuals of successive captures are correlated, as with drift: let sensor and lasers warm up,"
    " and repeat with the standoffs in another order",
    "variance over standoff": "the variance of the residuals depends on the standoff: state spot noise and"
    " speckle for each standoff (u_sd_px, v_sd_px), or improve the exposure",
    "variance of u and v": "the residuals' variances in u and v differ from those stated: state u_sd_px and"
    " v_sd_px, and look at the shape of the spots",
    "variance of laser": "the variance of the residuals of laser {} differs from the others': look at its"
    " spots (focus, speckle, a second mode)",
    "repeats: order": "successive repeats are correlated, as with motion or lag: wait longer after switching"
    " a laser (frames in flight) and after placing the target",
    "repeats: over standoff": "the variance of repeats depends on the standoff: state u_sd_px and v_sd_px for"
    " each standoff",
    "repeats: u and v": "the variances of repeats in u and v differ from those stated: state u_sd_px and"
    " v_sd_px",
    "repeats: laser": "the variance of repeats of laser {} differs from the others': check its mount and its"
    " supply",
}


@dataclass(frozen=True)
class _Spots:
    """Measured coordinates of all spots, n of them, in the order of the captures."""

    residual: FloatArray
    """(n,) in standard deviations."""
    covariance: FloatArray
    """(n, n) of the residuals."""
    sd_px: FloatArray
    """(n,) 1 sigma."""
    laser: IndexArray
    """(n,) index of the laser."""
    axis: IndexArray
    """(n,) 0 for u, 1 for v."""
    outward: FloatArray
    """(n,) share of the coordinate in the direction of the laser's baseline: 1 or -1 along it, 0 across."""
    distance: FloatArray
    """(n,) logarithm of the standoff, scaled to -1 to 1."""
    place: FloatArray
    """(n, 2) fitted position, -1 to 1 over the image; the measured one would correlate with its noise."""

    @classmethod
    def of(cls, fit: CalibrationFit) -> _Spots:
        cells, problem = fit.cells, problem_of(fit)
        size = np.array([fit.rig.camera.width_px, fit.rig.camera.height_px])
        whole: Refit = refit(problem, measured(problem), optimum_of(fit), fit.noise_scale)
        rows = np.flatnonzero(measured(problem)[: 2 * len(cells.laser)])
        own = whole.jacobian[rows]
        laser, axis = cells.laser[rows // 2], rows % 2
        standoff = np.array([p.standoff_mm for p in cells.placements])[cells.placement]
        rays = rays_of_rig(fit.rig)
        axes = axes_of(rays)
        outward = axes * np.sign((axes * rays[:, :2]).sum(axis=1))[:, None]
        return cls(
            residual=whole.residual[rows],
            covariance=np.eye(len(rows)) - own @ whole.covariance @ own.T,
            sd_px=cells.sd_px.ravel()[rows],
            laser=laser,
            axis=axis,
            outward=outward[laser, axis],
            distance=_spread(np.log(standoff))[rows // 2],
            place=(2 * whole.predicted_px / size - 1)[rows // 2],
        )

    def trend_p(self, pixels: FloatArray) -> float:
        """P value of the score test of a trend (n, k), px; NaN where the parameters absorb it completely."""
        trend = pixels / self.sd_px[:, None]
        trend = trend[:, (trend**2).sum(axis=0) > 0]
        trend = trend / np.sqrt((trend**2).sum(axis=0))
        left, directions = np.linalg.eigh(trend.T @ self.covariance @ trend)
        seen = left > ABSORBED
        score = directions[:, seen].T @ (trend.T @ self.residual)
        return float(chi2_sf((score**2 / left[seen]).sum(), seen.sum())) if seen.any() else float("nan")

    def quadratic_p(self, weight: FloatArray) -> float:
        """Two-sided p value of r^T B r, B (n, n), at any noise level; NaN if the form cannot vary."""
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
    """P values of trends (Legendre polynomials up to degree 3) over the standoff, by laser, over u and v."""
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
    """P values of lag 1 between successive spots, and of contrasts of their variance."""
    order = np.zeros(spots.covariance.shape)
    for axis in (0, 1):
        own = np.flatnonzero(spots.axis == axis)
        order[own[:-1], own[1:]] = order[own[1:], own[:-1]] = 0.5
    yield ("order", spots.quadratic_p(order))
    for name, weight in _contrasts(fit, spots.laser, spots.axis, spots.distance):
        yield (f"variance {name}", spots.quadratic_p(np.diag(weight)))


def _contrasts(
    fit: CalibrationFit, laser: IndexArray, axis: IndexArray, distance: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    """Contrasts of variances: over the standoff, of u against v, of each laser; weights with mean 0."""
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
    """P values of lag 1 between successive repeats, and of contrasts of their variance."""
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
    """Share of equal numbers among all pairs of repeats of a spot; 0 where there are no pairs."""
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
    """(m,) unit vector that subtracting the mean removes."""

    @classmethod
    def of(cls, fit: CalibrationFit, cell: int, axis: int) -> _Repeats:
        members = fit.cells.members[cell]
        value = positions(members)[:, axis]
        seen = np.isfinite(value)
        inverse = 1.0 / (fit.cells.repeat_scale * stated_sd(members, fit.rig.noise)[seen, axis])
        direction = inverse / np.sqrt((inverse**2).sum())
        white = value[seen] * inverse
        return cls(cell, axis, white - direction * (direction @ white), direction)

    def lag_mean(self) -> float:
        """Expectation of the sum of products of neighbours, at unit noise."""
        return -float(self.direction[:-1] @ self.direction[1:])

    def lag(self, mean: float) -> tuple[float, float, float]:
        """Sum of products of neighbours - `mean` times the sum of squares: value, variance, third moment.

        With F the matrix of the form and d the direction removed, the moments are the traces of powers of
        F (1 - d d^T). F has two values only, so that they are written out: no matrix is built, because the
        repeats may be thousands.
        """

        def form(x: FloatArray) -> FloatArray:
            return np.convolve(x, (0.5, -mean, 0.5))[1:-1]

        count, once = len(self.deviation), form(self.direction)
        first, second, third = self.direction @ once, once @ once, once @ form(once)
        square = (count - 1) / 2 + mean**2 * count - 2 * second + first**2
        cube = -1.5 * mean * (count - 1) - mean**3 * count - 3 * third + 3 * first * second - first**3
        return float(self.deviation @ form(self.deviation)), 2 * float(square), 8 * float(cube)


def _by_axis(axes: FloatArray, powers: NDArray[np.floating]) -> FloatArray:
    return (axes[:, :, None] * powers[:, None]).reshape(len(axes), -1)


def _spread(values: NDArray[np.floating]) -> FloatArray:
    """Values scaled linearly to -1 .. 1; 0 where all are equal."""
    low, high = np.nanmin(values), np.nanmax(values)
    return np.asarray(
        np.nan_to_num((2 * values - low - high) / (high - low if high > low else np.inf)), np.float64
    )


def _two_sided(value: float, mean: float, variance: float, third: float) -> float:
    """Two-sided p value by the gamma distribution with these moments; normal at negligible skewness."""
    z, skew = (value - mean) / variance**0.5, third / variance**1.5
    if abs(skew) < 1e-3:
        return float(2 * norm_cdf(-abs(z)))
    shape = 4 / skew**2
    x = max(shape + np.sign(skew) * z * shape**0.5, 0.0)
    return float(2 * min(gamma_cdf(x, shape), gamma_sf(x, shape)))
