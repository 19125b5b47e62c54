"""Interpolations against functions that they hold exactly, and one that they approach."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.optics.equidistant import EQUIDISTANT
from workbench.optics.plumb_bob import PLUMB_BOB
from workbench.sensor.interpolation import AngleSeries, Interpolation, PolynomialInterpolation, interpolations

T = np.array([-3.0, -0.4, 0.0, 1e-6, 0.7, 2.5])


def table(by: Interpolation, values: np.ndarray) -> np.ndarray:
    return np.linalg.solve(by.basis(by.nodes), values)[None, :, None]


@pytest.mark.parametrize("by", [PolynomialInterpolation(8), AngleSeries(24)], ids=["polynomial", "series"])
def test_variable_and_argument_are_inverse(by: Interpolation) -> None:
    s = by.variable(T)
    np.testing.assert_allclose(by.argument(s), T, rtol=1e-14, atol=1e-16)
    step = 1e-6
    numeric = (by.argument(s + step) - by.argument(s - step)) / (2 * step)
    np.testing.assert_allclose(np.broadcast_to(by.argument_slope(s), T.shape), numeric, rtol=1e-8)


def test_a_polynomial_is_exact_far_beyond_its_nodes() -> None:
    by, coefficients = PolynomialInterpolation(8), np.array([1.0, -2.0, 0.5, 3.0, 0.0, -1.0, 0.2, 0.1])
    found = table(by, np.polynomial.polynomial.polyval(by.nodes, coefficients))
    np.testing.assert_allclose(
        (by.basis(T) @ found)[0, :, 0], np.polynomial.polynomial.polyval(T, coefficients), rtol=1e-12
    )
    slope = (by.basis(T) @ by.derivative(found))[0, :, 0]
    derivative = np.polynomial.polynomial.polyder(coefficients)
    np.testing.assert_allclose(slope, np.polynomial.polynomial.polyval(T, derivative), rtol=1e-11)


def test_a_series_in_the_angle_converges_geometrically() -> None:
    """A smooth function of the angle, with its nearest pole at some distance."""

    def function(t: np.ndarray) -> np.ndarray:
        return np.asarray(1.0 / (4.0 + np.sin(2.0 * np.arctan(t))))

    errors = []
    for terms in (16, 32, 64):
        by = AngleSeries(terms)
        found, s = table(by, function(by.argument(by.nodes))), by.variable(T)
        errors.append(np.abs((by.basis(s) @ found)[0, :, 0] - function(T)).max())
    assert errors[1] < 30 * errors[0] ** 2  # twice the terms, twice the digits
    assert errors[2] < 1e-13
    step = 1e-6
    numeric = (function(by.argument(s + step)) - function(by.argument(s - step))) / (2 * step)
    slope = (by.basis(s) @ by.derivative(found))[0, :, 0]
    np.testing.assert_allclose(slope, numeric, rtol=1e-6, atol=1e-8)


def test_a_lens_says_which_interpolation_holds() -> None:
    (by,) = interpolations(PLUMB_BOB)
    assert isinstance(by, PolynomialInterpolation)
    assert by.terms == 8
    lengths = [by.terms for by in interpolations(EQUIDISTANT)]
    assert lengths == sorted(lengths)
    assert all(isinstance(by, AngleSeries) for by in interpolations(EQUIDISTANT))
