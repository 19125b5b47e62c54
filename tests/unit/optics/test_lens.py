"""A lens model as such: pixels of distorted coordinates, kinds of arrays, order of parameters."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from workbench.optics.lens import EitherArray, LensModel, Numbers, as_array
from workbench.optics.lens_models import LENS_MODELS


def _squeezed(coefficients: Numbers, x: EitherArray, y: EitherArray) -> tuple[EitherArray, EitherArray]:
    """A lens whose first coefficient stretches x and whose second shifts y."""
    return x * (1.0 + coefficients[0]), y + coefficients[1]


def _slope(coefficients: Numbers, x: EitherArray, y: EitherArray) -> EitherArray:
    return as_array(1.0 - coefficients[2] * (x * x + y * y))


LENS = LensModel("equidistant", _squeezed, _slope, {}, ())


def test_pixels_are_those_of_the_distorted_coordinates() -> None:
    numbers = np.array([500.0, 320.0, 240.0, 0.1, 0.02, 0.0, 0.0])
    u, v = LENS.project(numbers, np.array([0.2, -0.4]), np.array([0.1, 0.3]))
    np.testing.assert_allclose(u, 320.0 + 500.0 * 1.1 * np.array([0.2, -0.4]))
    np.testing.assert_allclose(v, 240.0 + 500.0 * (np.array([0.1, 0.3]) + 0.02))


def test_the_model_folds_over_where_the_radius_no_longer_grows() -> None:
    numbers = np.array([500.0, 320.0, 240.0, 0.0, 0.0, 4.0, 0.0])
    unfolded = LENS.is_unfolded(numbers, np.array([0.0, 0.49, 0.5, 0.3]), np.array([0.0, 0.0, 0.0, 0.45]))
    assert np.asarray(unfolded).tolist() == [True, True, False, False]


def test_numpy_s_arrays_stay_and_anything_else_becomes_jax_s() -> None:
    array = np.array([1.0 + 2.0j])
    assert as_array(array) is array
    assert isinstance(as_array(0.5), Array)
    assert isinstance(as_array(jnp.ones(2)), Array)
    assert isinstance(LENS.project(np.ones((7, 1)), np.ones(2), np.ones(2))[0], np.ndarray)


@pytest.mark.parametrize("model", LENS_MODELS.values(), ids=LENS_MODELS)
def test_parameters_begin_with_the_pinhole_s(model: LensModel) -> None:
    assert model.parameters == ("f_px", "cx_px", "cy_px", *model.coefficients)
