"""Tables of a fit."""

from __future__ import annotations

from tests.viewer.session import BAD, a_fit
from workbench.model.fit_event import ParameterRecord
from workbench.model.fit_tables import cross_validation_table, fit_tables, parameter_table, term_table


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
        f"relative_error.{BAD[0]}": 4.25 / BAD[1],
    }
    assert [table.text(0, column) for column in range(6)] == ["1250", "+2.50", "0.5", "+5.0", "!", "+0.34"]


def test_terms_have_their_evidence() -> None:
    table = term_table(a_fit().terms)
    assert [table.text(0, column) for column in range(4)] == ["k2", "0.91", "-0.9", "0.02"]


def test_only_tables_with_rows_are_shown() -> None:
    fit = a_fit()
    assert [table.name for table in fit_tables(fit)] == ["parameters", "terms", "cross_validation"]
    bare = fit.model_copy(update={"terms": (), "left_out": ()})
    assert [table.name for table in fit_tables(bare)] == ["parameters"]
