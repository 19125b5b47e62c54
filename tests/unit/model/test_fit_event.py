"""The event of a fit: JSON keeps it, and what does not belong to it is refused."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError
from scipy import stats

from tests.support.fits import cross_validated
from tests.viewer.session import a_fit
from workbench.model.fit_event import CrossValidatedPlacement, FitFinished


def test_a_fit_survives_json() -> None:
    fit = a_fit()
    again = FitFinished.model_validate_json(fit.model_dump_json())
    assert again == fit
    assert (len(again.parameters), len(again.residuals)) == (len(fit.parameters), len(fit.residuals))


def test_a_fit_of_an_early_session_lacks_terms_validation_and_tests() -> None:
    early = {"terms", "left_out", "faults", "residual_tests"}
    fit = FitFinished.model_validate(a_fit().model_dump(exclude=early))
    assert [getattr(fit, name) for name in sorted(early)] == [(), (), (), ()]


@pytest.mark.parametrize(
    "change", [{"verdict": "fine"}, {"rms_px": float("nan")}, {"observations": 2.5}, {"colour": "red"}]
)
def test_values_that_cannot_be_are_refused_by_their_key(change: dict[str, Any]) -> None:
    with pytest.raises(ValidationError) as caught:
        FitFinished.model_validate(a_fit().model_dump() | change)
    assert [error["loc"] for error in caught.value.errors()] == [tuple(change)]


def test_a_parameter_is_determined_by_data_joint_or_prior() -> None:
    fit = a_fit().model_dump()
    fit["parameters"][0]["determined_by"] = "luck"
    with pytest.raises(ValidationError) as caught:
        FitFinished.model_validate(fit)
    assert [error["loc"] for error in caught.value.errors()] == [("parameters", 0, "determined_by")]


def placement(**change: Any) -> CrossValidatedPlacement:
    values = {"placement": "p", "standoff_mm": 500.0, "error_mm": -3.0, "sd_mm": 1.5, "lasers": ()}
    return CrossValidatedPlacement.model_validate(values | change)


def test_range_errors_have_the_p_value_of_their_distribution() -> None:
    assert placement().z == -2.0
    assert placement().range_p == pytest.approx(2 * stats.norm.sf(2.0))
    assert placement(freedom=5.0).range_p == pytest.approx(2 * stats.t.sf(2.0, 5))


@pytest.mark.parametrize(
    ("error_mm", "chi2", "alarm", "test"),
    [(9.0, 8.0, True, "range"), (1.0, 90.0, True, "spots"), (9.0, 90.0, False, "")],
)
def test_an_alarm_names_the_test_that_raises_it(error_mm: float, chi2: float, alarm: bool, test: str) -> None:
    one = cross_validated("p.1/300mm", 300.0, error_mm, alarm)
    assert one.model_copy(update={"chi2": chi2, "coordinates": 8}).alarm_test == test


def test_spots_have_the_p_value_of_their_distribution() -> None:
    assert placement(chi2=20.0).spots_p == 1.0
    assert placement(chi2=20.0, coordinates=8).spots_p == pytest.approx(stats.chi2.sf(20.0, 8))
    assert placement(chi2=20.0, coordinates=8, freedom=5.0).spots_p == pytest.approx(stats.f.sf(2.5, 8, 5))
