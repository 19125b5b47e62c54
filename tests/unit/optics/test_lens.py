"""A lens model as such: pixels of distorted coordinates, kinds of arrays, order of parameters."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from workbench.model.lens import LensName
from workbench.optics.lens import EitherArray, LensModel, Numbers, as_array
from workbench.optics.lens_models import LENS_MODELS


def _squeezed(coefficients: Numbers, x: EitherArray, y: EitherArray) -> tuple[EitherArray, EitherArray]:
    """A lens whose first coefficient stretches x and whose second shifts y."""
    return x * (1.0 + coefficients[0]), y + coefficients[1]


LENS = LensModel("equidistant", _squeezed, ("k3",), lambda variable: 2.0 * variable, {}, ())


def test_pixels_are_those_of_the_distorted_coordinates() -> None:
    numbers = np.array([500.0, 320.0, 240.0, 0.1, 0.02, 0.0, 0.0])
    u, v = LENS.project(numbers, np.array([0.2, -0.4]), np.array([0.1, 0.3]))
    np.testing.assert_allclose(u, 320.0 + 500.0 * 1.1 * np.array([0.2, -0.4]))
    np.testing.assert_allclose(v, 240.0 + 500.0 * (np.array([0.1, 0.3]) + 0.02))


def test_the_model_folds_over_where_the_radius_no_longer_grows() -> None:
    """q - q^3 / 0.1875 grows up to q = 0.25, here a radius of 0.5."""
    numbers = np.array([500.0, 320.0, 240.0, 0.0, 0.0, -1 / 0.1875, 0.0])
    unfolded = LENS.is_unfolded(numbers, np.array([0.0, 0.49, 0.51, 0.3]), np.array([0.0, 0.0, 0.0, 0.45]))
    assert unfolded.tolist() == [True, True, False, False]


FOLDING = {
    "plumb_bob": (0.95986, 1.55310, [-0.5, 0.09, 0.0, 0.0, 0.0]),
    "equidistant": (np.tan(0.93451), np.tan(1.23561), [-0.6, 0.15, 0.0, 0.0]),
}
"""Radii between which the distorted radius shrinks, and the coefficients."""


@pytest.mark.parametrize("name", FOLDING)
def test_a_model_that_has_folded_stays_folded_where_its_radius_grows_again(name: LensName) -> None:
    first, second, coefficients = FOLDING[name]
    model, zero = LENS_MODELS[name], np.zeros(5)
    assert float(model.unfolded_radius(coefficients)) == pytest.approx(first, rel=1e-3)
    radius = np.array([0.99 * first, 1.01 * first, 0.99 * second, 1.01 * second, 3.0 * second])
    assert model.is_unfolded([1.0, 0.0, 0.0, *coefficients], radius, zero).tolist() == [True, *[False] * 4]
    ahead, behind = (model.distort(coefficients, radius + d, zero)[0] for d in (1e-6, -1e-6))
    assert (np.asarray(ahead - behind) > 0).tolist() == [True, False, False, True, True]


@pytest.mark.parametrize("model", LENS_MODELS.values(), ids=LENS_MODELS)
def test_many_lenses_fold_where_each_does_by_its_own(model: LensModel) -> None:
    lenses = np.random.default_rng(2).normal(0.0, 0.3, (40, len(model.coefficients)))
    lenses[0] = 0.0
    radius = np.tan(np.linspace(0.0, np.pi / 2, 20001)[1:-1])
    distorted = np.array([model.distort(lens, radius, np.zeros_like(radius))[0] for lens in lenses])
    if model.name == "plumb_bob":
        distorted -= 3.0 * lenses[:, 3:4] * radius**2  # the tangential terms are no part of the radius
    falls = np.diff(distorted, axis=1) < 0
    first = np.where(falls.any(axis=1), radius[falls.argmax(axis=1)], np.inf)
    np.testing.assert_allclose(np.arctan(model.unfolded_radius(lenses.T)), np.arctan(first), atol=3e-4)
    assert np.isinf(first[0])
    assert np.isfinite(first).sum() >= 10


def test_numpy_s_arrays_stay_and_anything_else_becomes_jax_s() -> None:
    array = np.array([1.0 + 2.0j])
    assert as_array(array) is array
    assert isinstance(as_array(0.5), Array)
    assert isinstance(as_array(jnp.ones(2)), Array)
    assert isinstance(LENS.project(np.ones((7, 1)), np.ones(2), np.ones(2))[0], np.ndarray)


@pytest.mark.parametrize("model", LENS_MODELS.values(), ids=LENS_MODELS)
def test_parameters_begin_with_the_pinhole_s(model: LensModel) -> None:
    assert model.parameters == ("f_px", "cx_px", "cy_px", *model.coefficients)
