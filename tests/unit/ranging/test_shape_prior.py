"""The prior over shapes as Gaussian components."""

from __future__ import annotations

from dataclasses import fields, replace
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from workbench.model.errors import BadInputError
from workbench.ranging.shape_prior import ShapePrior, prior_components

FRONT_MM = (-60.0, 60.0)
PRIOR = ShapePrior()


def test_the_probabilities_of_four_lasers_sum_to_1() -> None:
    assert np.exp(prior_components(PRIOR, FRONT_MM).log_mass).sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("flat", "incline"), [(1.0, 1.0), (0.5, 0.12), (1.12, -0.56)])
def test_probabilities_that_are_none_are_refused(flat: float, incline: float) -> None:
    with pytest.raises(BadInputError, match="ShapePrior"):
        ShapePrior(flat=flat, incline=incline)


@pytest.mark.parametrize("name", [field.name for field in fields(ShapePrior)])
@pytest.mark.parametrize(
    "wrong", [None, "x", True, -1.0, nan, inf, 1e300, 1j, (), ("x",), (1.0, nan), [1.0, 2.0, 3.0]]
)
def test_a_wrong_value_of_a_field_is_refused_by_its_name(name: str, wrong: Any) -> None:
    with pytest.raises(BadInputError, match=name):
        ShapePrior(**{name: wrong})


def test_an_irregular_surface_has_three_sizes() -> None:
    two: Any = (1.0, 1.0)
    with pytest.raises(BadInputError, match="irregular_sds"):
        replace(PRIOR, irregular_sds=two)


@pytest.mark.parametrize(("highest", "degrees"), [(1, {0, 1}), (2, {0, 1, 2}), (3, {0, 1, 2, 3})])
def test_components_of_higher_degrees_are_left_out(highest: int, degrees: set[int]) -> None:
    components = prior_components(PRIOR, FRONT_MM, highest)
    assert set(components.degree.tolist()) == degrees
    assert components.mean_mm.shape == (len(components.degree), highest)


def test_amplitudes_are_sizes_times_powers_of_half_the_front() -> None:
    prior = replace(PRIOR, slope_sds=(0.5,), curvatures_per_mm=(0.01,), concave=0.0)
    narrow, wide = (prior_components(prior, (-half, half)) for half in (10.0, 30.0))
    for components, half in ((narrow, 10.0), (wide, 30.0)):
        incline, parabola = (int(np.flatnonzero(components.degree == d)[0]) for d in (1, 2))
        assert components.sd_mm[incline, 0] == pytest.approx(0.5 * half)
        assert components.mean_mm[parabola, 1] == pytest.approx(0.01 * half**2)
        # The apex lies at -half slope / (2 curvature).
        sd = components.sd_mm[parabola, 0] / (2.0 * components.mean_mm[parabola, 1])
        assert sd == pytest.approx(prior.apex_sd)


def test_higher_degrees_have_the_size_of_the_cubic_one() -> None:
    components = prior_components(PRIOR, FRONT_MM, 5)
    highest = components.sd_mm[components.degree == 5]
    np.testing.assert_allclose(highest[:, 3:], np.repeat(highest[:, 2:3], 2, axis=1))
