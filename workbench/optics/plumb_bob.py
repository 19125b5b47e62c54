"""Lens model `plumb_bob`: the pinhole with Brown-Conrady distortion k1 k2 p1 p2 k3.

Source: D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37 (1971), with OpenCV's
order of coefficients.
"""

from __future__ import annotations

from workbench.optics.lens import EitherArray, LensModel, Numbers


def _distort(coefficients: Numbers, x: EitherArray, y: EitherArray) -> tuple[EitherArray, EitherArray]:
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    x_distorted = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    y_distorted = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    return x_distorted, y_distorted


PLUMB_BOB = LensModel(
    name="plumb_bob",
    distort=_distort,
    radial_terms=("k1", "k2", "k3"),
    undistorted_radius=lambda radius: radius,
    trial_sd={"k1": 0.3, "k2": 0.3, "p1": 0.003, "p2": 0.003, "k3": 0.3},
    terms=("k3", "p1 p2", "k2", "k1"),
    polynomial_degree=7,
)
