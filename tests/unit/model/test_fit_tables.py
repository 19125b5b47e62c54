"""Tables of a fit."""

from __future__ import annotations

from tests.viewer.session import BAD, a_fit
from workbench.model.fit_event import CrossValidatedPlacement, ParameterRecord
from workbench.model.fit_tables import (
    cross_validation_table,
    fit_tables,
    parameter_table,
    term_table,
    worst_placements_table,
)


def test_parameters_have_values_priors_and_information_share() -> None:
    table = parameter_table(a_fit().parameters)
    assert [column.heading for column in table.columns] == [
        "parameter",
        "value",
        "sd",
        "unit",
        "prior",
        "prior sd",
        "information share (%)",
        "determined by",
    ]
    texts = [table.text(1, column) for column in range(8)]
    assert texts == ["cx_px", "358.2", "2.1", "px", "319.5", "40", "100", "data"]


def test_fixed_parameters_are_in_the_caption() -> None:
    free, *_ = a_fit().parameters
    fixed = ParameterRecord.model_validate(
        free.model_dump() | {"name": "k3", "value": 0.25, "sd": 0.0, "prior_value": 0.25, "prior_sd": 0.0}
    )
    table = parameter_table([free, fixed])
    assert [row[0] for row in table.rows] == ["f_px"]
    assert table.caption.endswith("k3 0.25")


def test_cross_validation_has_errors_alarms_and_each_laser() -> None:
    table = cross_validation_table(a_fit().left_out)
    (record,) = table.records()
    assert record == {
        "standoff_mm": BAD[1],
        "error_mm": 2.5,
        "sd_mm": 0.5,
        "normalised_error": 5.0,
        "alarm": True,
        "alarm_test": "range",
        f"relative_error.{BAD[0]}": 4.25 / BAD[1],
    }
    assert [table.text(0, column) for column in range(5)] == ["1250", "+2.50", "0.5", "+5.0", "!"]
    assert [table.text(0, column) for column in (5, 6)] == ["range", "+0.34"]


def test_terms_have_their_evidence() -> None:
    table = term_table(a_fit().terms)
    assert [table.text(0, column) for column in range(4)] == ["k2", "0.91", "-0.9", "0.02"]


def test_only_tables_with_rows_are_shown() -> None:
    fit = a_fit()
    assert [table.name for table in fit_tables(fit)] == ["parameters", "terms", "cross_validation"]
    bare = fit.model_copy(update={"terms": (), "left_out": ()})
    assert [table.name for table in fit_tables(bare)] == ["parameters"]


def placement(key: str, error_mm: float, chi2: float = 0.0) -> CrossValidatedPlacement:
    return CrossValidatedPlacement(
        placement=key, standoff_mm=900.0, error_mm=error_mm, sd_mm=1.0, lasers=(), chi2=chi2, coordinates=8
    )


def test_the_least_probable_placements_are_first_by_range_or_by_spots() -> None:
    """Range errors of 1 to 4 sd; one placement with spots that the fit does not explain."""
    errors = {"a": 1.0, "b": -3.0, "c": 4.0, "d": 2.0, "e": -1.5, "f": 0.5}
    left_out = (*(placement(key, error) for key, error in errors.items()), placement("g", 0.1, chi2=60.0))
    fit = a_fit().model_copy(update={"left_out": left_out})
    table = worst_placements_table(fit, {"g": "81-120", "c": "1-40"}, most=5)
    records = table.records()
    assert [one["error_mm"] for one in records] == [0.1, 4.0, -3.0, 2.0, -1.5]
    assert [one["captures"] for one in records] == ["81-120", "1-40", "", "", ""]
    p_values = [one["p"] for one in records]
    assert p_values == sorted(p_values, key=lambda p: p if isinstance(p, float) else 1.0)
    assert len(worst_placements_table(fit, {}, most=2).rows) == 2
