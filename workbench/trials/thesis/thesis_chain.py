"""Chain of the thesis's simulation, including its idealisations and peculiarities, for comparison.

Deborah L. Tran, "Obstacle Detection for Robot Navigation Using Structured Light", MIT 2001: equations (4.3),
(4.4), (4.6) to (4.9), sections 5.2.1, 5.2.2.3, 5.2.3 and Appendix A. Its frames have no noise, so one row of
pixels suffices. The text excludes pixels farther from a spot's centre than its radius, the program does not;
the farthest distance of 12.6 m follows from the program (docs/thesis-simulation.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.model.arrays import BoolArray, FloatArray
from workbench.trials.thesis.scene import LaserLine, Outcome, angle_deg

IntArray = NDArray[np.int64]
BRIGHTEST_DN = 255
AMBIGUOUS_PX = 2
"""Half width of the zone around the centre whose pixels are ignored: there the two lines of lasers cross."""
FLAT_SLOPE = 1e-4
HALF_PX = 0.5
FRONT_STEP_MM = 0.1


def read(line: LaserLine, depths_mm: FloatArray, lit: BoolArray) -> Outcome:
    """One reading: all lasers at once, then each alone if the number of spots differs from that of lasers.

    Args:
        line: line of lasers.
        depths_mm: (n,) depths at which the beams end.
        lit: (n,) lasers whose spots are visible.
    """
    centres = spot_centres(line, depths_mm, lit)
    lasers = np.arange(len(lit))
    if len(centres) != len(lit):
        alone = [spot_centres(line, depths_mm, lit & (lasers == n)) for n in lasers]
        lasers = np.flatnonzero([len(found) > 0 for found in alone])
        centres = np.array([found[0] for found in alone if len(found)])
    if not len(centres):
        return Outcome(None, "none")
    return shape_of(line, lasers, ranges_mm(line, lasers, centres), sigmas_mm(line, lasers, centres))


def spot_centres(line: LaserLine, depths_mm: FloatArray, lit: BoolArray) -> FloatArray:
    """Centres of mass (m,), (4.8), of adjacent bright pixels outside the ambiguous zone, ascending."""
    row = draw(line, depths_mm, lit)
    bright = np.flatnonzero(row)
    bright = bright[np.abs(bright - line.centre_px) > AMBIGUOUS_PX]
    groups = np.split(bright, np.flatnonzero(np.diff(bright) > 1) + 1) if len(bright) else []
    return np.array([(group * row[group]).sum() / row[group].sum() for group in groups])


def draw(line: LaserLine, depths_mm: FloatArray, lit: BoolArray) -> IntArray:
    """Row of pixels (length,) with the spots: (4.7), rounded; later spots overwrite earlier ones.

    A spot is drawn in a square with its sides at whole pixels, both rounded as in the thesis's program.
    """
    row = np.zeros(line.length_px, np.int64)
    spots, radii = line.spots_px(depths_mm), line.radii_px(depths_mm)
    for centre, radius in zip(spots[lit], radii[lit], strict=True):
        half = np.ceil(radius)
        pixels = np.arange(np.trunc(centre - half), np.ceil(centre + half)).astype(np.int64)
        pixels = pixels[(pixels >= 0) & (pixels < line.length_px)]
        intensity = np.exp(-2 * (pixels - centre) ** 2 / radius**2)
        row[pixels] = np.floor(BRIGHTEST_DN * intensity + 0.5).astype(np.int64)
    return row


def ranges_mm(line: LaserLine, lasers: IntArray, centres: FloatArray, moved_px: float = 0.0) -> FloatArray:
    """Ranges (m,), (4.3), of assigned spots, moved by `moved_px` away from the centre."""
    baselines = line.baselines_mm[lasers]
    away = np.sign(baselines) * (centres - line.centre_px) + moved_px
    return np.asarray(line.f_px * np.abs(baselines) / away)


def sigmas_mm(line: LaserLine, lasers: IntArray, centres: FloatArray) -> FloatArray:
    """Range errors (m,) of half a pixel (4.4), which the thesis uses as standard deviations."""
    farther = ranges_mm(line, lasers, centres, -HALF_PX)
    nearer = ranges_mm(line, lasers, centres, HALF_PX)
    return (farther - nearer) / 2


def fit(x_mm: FloatArray, y_mm: FloatArray, sigma_mm: FloatArray, degree: int) -> tuple[FloatArray, float]:
    """Coefficients of 1, x, x^2, ... by least squares, and chi^2 (4.9)."""
    scale = np.abs(x_mm).max() or 1.0
    design = np.vander(x_mm / scale, degree + 1, increasing=True) / sigma_mm[:, None]
    scaled, *_ = np.linalg.lstsq(design, y_mm / sigma_mm)
    misfit = design @ scaled - y_mm / sigma_mm
    return np.asarray(scaled / scale ** np.arange(degree + 1)), float(misfit @ misfit)


def shape_of(line: LaserLine, lasers: IntArray, y_mm: FloatArray, sigma_mm: FloatArray) -> Outcome:
    """Shape and closest range: the lowest degree of polynomial with chi^2 < m - 1.

    A single spot is taken as a flat, because the thesis does not state the result of its program.
    """
    x_mm = line.front_mm[lasers]
    if len(x_mm) == 1:
        return Outcome(float(y_mm[0]), "flat")
    accepted = len(x_mm) - 1
    coefficients, chi2 = fit(x_mm, y_mm, sigma_mm, 1)
    if chi2 < accepted:
        return _straight(line, coefficients)
    for degree in range(2, len(x_mm)):
        coefficients, chi2 = fit(x_mm, y_mm, sigma_mm, degree)
        if chi2 < accepted:
            closest = _lowest(line, coefficients, len(x_mm))
            return Outcome(closest, f"round {degree}") if closest > 0 else _unknown(y_mm)
    return _unknown(y_mm)


def _straight(line: LaserLine, coefficients: FloatArray) -> Outcome:
    at_first, slope = coefficients.tolist()
    if abs(slope) < FLAT_SLOPE:
        return Outcome(at_first, "flat")
    # One spacing more than lasers: the front of the thesis's program ends beyond its last laser.
    beyond = _spacing(line) * (len(line.ids) + 1)
    return Outcome(min(at_first, at_first + slope * beyond), "incline", angle_deg(slope))


def _lowest(line: LaserLine, coefficients: FloatArray, spots: int) -> float:
    """Smallest value along the front, whose length is the number of spots times the spacing."""
    x = np.arange(0.0, spots * _spacing(line), FRONT_STEP_MM)
    return float(np.polynomial.Polynomial(coefficients)(x).min())


def _spacing(line: LaserLine) -> float:
    return float(np.diff(line.baselines_mm).min())


def _unknown(y_mm: FloatArray) -> Outcome:
    return Outcome(float(y_mm.min()), "unknown")
