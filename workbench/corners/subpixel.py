"""Sub-pixel position of a chessboard's corners, with its standard deviation.

The model of a corner is two straight edges that cross, each blurred to an error function:

    I(x) = a + b erf(d1 / (sqrt(2) w)) erf(d2 / (sqrt(2) w)),    d = distance from an edge through the corner

It has seven unknowns: the corner (u, v), the direction of each edge, the blur w, and the tones a, b. The true
image of two edges that are not at right angles differs from the product. It is point-symmetric like the
product, so that the position of the corner is not biased.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from workbench.model.arrays import BoolArray, FloatArray

WINDOW_PX = 6.0
"""Radius of a window. Distortion bends edges: in a larger one a strong lens moves the corner by 0.01 px."""
SQUARE_SHARE = 0.45
"""Largest radius of a window as a share of a square, so that it excludes the edges of the next corner."""
MARKER_PAD_PX = 1.7
"""Distance from a marker within which pixels are affected by its blur."""
NARROWEST_EDGE_PX = 0.7
"""Least width of blank paper beside an edge between two markers."""
STEPS = 25
STEP_TOLERANCE_PX = 1e-4
OUTLIER_SD = 4.5
"""Residual from which a pixel is an outlier (hot, or dirt); 1 of 1000 corners loses a good pixel of 150."""
TONES = (2.0, 98.0)
"""Percentiles of the pixels about all corners that stand for ink and paper."""
BLUR_RANGE_PX = (0.3, 4.0)
"""Range of the blur; a fit at either end is not a corner."""
START_BLUR_PX = 0.8
FARTHEST_MOVE_PX = 2.0
"""Largest distance of a fitted corner from its start."""
WORST_MISFIT = 9.0
"""Largest ratio of a corner's residual variance to that of all corners: over seven standard deviations."""
FLATTEST_SINE = 0.2
"""Least sine of the angle between the edges."""
FAINTEST_SD = 2.0
"""Least contrast in units of the noise of one pixel."""
FLOOR_SD_PX = 0.004
"""Error of the model (edges bent by the lens), 1 sigma; measured without noise by the tests."""


@dataclass(frozen=True)
class Saddles:
    """The n fitted corners."""

    position_px: FloatArray
    """(n, 2)"""
    sd_px: FloatArray
    """(n, 2) 1 sigma by axis, from the residuals of the pixels."""
    good: BoolArray
    """(n,) whether the fit is that of a corner; position and sd of others are meaningless."""


def fit_saddles(
    image: FloatArray, start_px: FloatArray, px_per_mm: FloatArray, square_mm: float, gap_mm: float
) -> Saddles:
    """Fit every corner.

    Args:
        image: (height, width), any linear unit.
        start_px: (n, 2) positions of the corners, to a pixel.
        px_per_mm: (n, 2, 2) derivatives of the pixel position by the board's x and y (columns), at each.
        square_mm: side of a square.
        gap_mm: distance from the edge of a white square to its marker.
    """
    x, y, tone, use = _windows(image, start_px, px_per_mm, square_mm, gap_mm)
    p = _start(start_px, px_per_mm, tone, use)
    # Clipped tones first: a hot pixel many times brighter than paper would dominate the fit of its corner.
    p = _improve(p, x, y, np.clip(tone, *np.percentile(tone, TONES)), use)
    rest = tone - _model(p, x, y)[0]
    scale = 1.4826 * float(np.median(np.abs(rest[use]))) if use.any() else 0.0
    use &= np.abs(rest) <= OUTLIER_SD * max(scale, 1e-12)
    p = _improve(p, x, y, tone, use)
    return _accepted(p, x, y, tone, use, start_px)


def _windows(
    image: FloatArray, start_px: FloatArray, px_per_mm: FloatArray, square_mm: float, gap_mm: float
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Pixel positions x, y, their tones, and whether they are used: all (n, pixels)."""
    span = np.arange(-int(WINDOW_PX), int(WINDOW_PX) + 1)
    dy, dx = (grid.ravel() for grid in np.meshgrid(span, span, indexing="ij"))
    middle = np.rint(start_px).astype(np.intp)
    x, y = middle[:, :1] + dx, middle[:, 1:] + dy
    height, width = image.shape
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    tone = image[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
    from_start = np.stack([x - start_px[:, :1], y - start_px[:, 1:]], axis=1)
    on_board = np.abs(np.linalg.pinv(px_per_mm) @ from_start)
    side_px = np.linalg.norm(px_per_mm, axis=1)
    radius = np.minimum(WINDOW_PX, SQUARE_SHARE * square_mm * side_px.min(axis=1))
    clear_mm = gap_mm - MARKER_PAD_PX / side_px
    resolved = (clear_mm * side_px >= NARROWEST_EDGE_PX).all(axis=1)
    off_markers = (on_board < clear_mm[:, :, None]).any(axis=1)
    near = np.hypot(from_start[:, 0], from_start[:, 1]) <= radius[:, None]
    # A window cut by the border is not symmetric about its corner, and biases it.
    whole = inside.all(axis=1)
    return x.astype(float), y.astype(float), tone, near & off_markers & (whole & resolved)[:, None]


def _start(start_px: FloatArray, px_per_mm: FloatArray, tone: FloatArray, use: BoolArray) -> FloatArray:
    """(n, 7) u, v, angles of both edges' normals, log of the blur, a, b (0: set by the first step)."""
    along_x, along_y = px_per_mm[:, :, 0], px_per_mm[:, :, 1]
    # The normal of the edge along the board's y points to the side of the board's x, and vice versa.
    angle_1 = np.arctan2(-along_y[:, 0], along_y[:, 1])
    angle_2 = np.arctan2(along_x[:, 0], -along_x[:, 1])
    counted = np.where(use, tone, np.nan)
    empty = ~use.any(axis=1)
    counted[empty] = 0.0
    a = (np.nanmax(counted, axis=1) + np.nanmin(counted, axis=1)) / 2
    n = len(start_px)
    return np.column_stack([start_px, angle_1, angle_2, np.full(n, np.log(START_BLUR_PX)), a, np.zeros(n)])


def _model(p: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tones (n, pixels) and their derivatives by the unknowns (n, pixels, 7)."""
    u, v, angle_1, angle_2, log_blur, a, b = (column[:, None] for column in p.T)
    blur = np.exp(log_blur)
    du, dv = x - u, y - v

    def edge(angle: FloatArray) -> tuple[FloatArray, ...]:
        c, s = np.cos(angle), np.sin(angle)
        d = (du * c + dv * s) / blur
        slope = np.sqrt(2 / np.pi) * np.exp(-(d**2) / 2)
        value = np.asarray(erf(d / np.sqrt(2)))
        return value, -slope * c / blur, -slope * s / blur, slope * (dv * c - du * s) / blur, -slope * d

    g, g_u, g_v, g_angle, g_blur = edge(angle_1)
    h, h_u, h_v, h_angle, h_blur = edge(angle_2)
    parts = (g_u * h + g * h_u, g_v * h + g * h_v, g_angle * h, g * h_angle, g_blur * h + g * h_blur)
    jacobian = [*(b * part for part in parts), np.ones_like(g), g * h]
    return a + b * g * h, np.stack(jacobian, axis=2)


def _improve(p: FloatArray, x: FloatArray, y: FloatArray, tone: FloatArray, use: BoolArray) -> FloatArray:
    """Gauss-Newton steps for all corners at once, the first for the tones alone.

    The loop is written out because it solves n small problems together and limits each step: 200 calls of a
    general solver would take many times as long.
    """
    p = p.copy()
    value, jacobian = _model(p, x, y)
    p[:, 5:] += _step(jacobian[:, :, 5:], tone - value, use)
    for _ in range(STEPS):
        value, jacobian = _model(p, x, y)
        step = _step(jacobian, tone - value, use)
        # In a window without a corner steps diverge; the limits keep its numbers finite.
        step[:, :2] = np.clip(step[:, :2], -0.5, 0.5)
        step[:, 2:5] = np.clip(step[:, 2:5], -0.3, 0.3)
        p += step
        p[:, 4] = np.clip(p[:, 4], *np.log(BLUR_RANGE_PX))
        if np.abs(step[:, :2]).max(initial=0.0) < STEP_TOLERANCE_PX:
            break
    return p


def _step(jacobian: FloatArray, rest: FloatArray, use: BoolArray) -> FloatArray:
    """(n, unknowns) solution of the normal equations, with scaled unknowns and damping near rounding."""
    weighted = np.where(use[:, :, None], jacobian, 0.0)
    information = weighted.transpose(0, 2, 1) @ weighted
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", information), 1e-300))
    unit = information / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(information.shape[1])
    gradient = np.einsum("npk,np->nk", weighted, np.where(use, rest, 0.0)) / scale
    return np.asarray(np.linalg.solve(unit, gradient[:, :, None])[:, :, 0] / scale)


def _accepted(
    p: FloatArray, x: FloatArray, y: FloatArray, tone: FloatArray, use: BoolArray, start_px: FloatArray
) -> Saddles:
    """The corners with their standard deviations; those that fail a check are not `good`."""
    value, jacobian = _model(p, x, y)
    freedom = use.sum(axis=1) - p.shape[1]
    enough = freedom > p.shape[1]
    square = np.where(use, (tone - value) ** 2, 0.0).sum(axis=1)
    variance = square / np.maximum(freedom, 1)
    # The noise is the same all over the frame: the corners' own estimates, 10 % each, are pooled.
    common = float(np.median(variance[enough])) if enough.any() else 0.0
    sane = (
        enough
        & (variance <= WORST_MISFIT * common)
        & (np.linalg.norm(p[:, :2] - start_px, axis=1) <= FARTHEST_MOVE_PX)
        & (np.exp(p[:, 4]) > 1.001 * BLUR_RANGE_PX[0])
        & (np.exp(p[:, 4]) < 0.999 * BLUR_RANGE_PX[1])
        & (np.abs(np.sin(p[:, 2] - p[:, 3])) >= FLATTEST_SINE)
        & (np.abs(p[:, 6]) >= FAINTEST_SD * np.sqrt(common))
    )
    weighted = np.where(use[:, :, None], jacobian, 0.0)[sane]
    noise = square[sane].sum() / max(freedom[sane].sum(), 1)
    sd = np.full((len(p), 2), np.nan)
    if sane.any():
        covariance = np.linalg.pinv(weighted.transpose(0, 2, 1) @ weighted, hermitian=True) * noise
        sd[sane] = np.hypot(np.sqrt(np.einsum("nii->ni", covariance)[:, :2]), FLOOR_SD_PX)
    return Saddles(p[:, :2], sd, sane)
