"""Tidy tables of a session, each column described."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.reference_session import REFERENCE, copied, edit_calibration, record
from workbench.model.errors import BadInputError
from workbench.report.data_dictionary import MEANINGS
from workbench.report.table_export import DICTIONARY, session_tables

DATA = REFERENCE.parents[1]


def test_every_column_of_every_table_is_described() -> None:
    tables = session_tables(REFERENCE)
    dictionary = tables.pop(DICTIONARY)
    described = set(zip(dictionary["table"], dictionary["column"], strict=True))
    assert described == {(name, column) for name, frame in tables.items() for column in frame.columns}
    assert (dictionary["meaning"].str.len() > 0).all()
    assert set(MEANINGS) <= set(tables)


def test_percent_are_exported_as_ratios_of_unit_1() -> None:
    dictionary = session_tables(REFERENCE)[DICTIONARY].set_index(["table", "column"])["unit"]
    assert dictionary["reference.6", "mean_relative_error"] == "1"
    assert dictionary["reference.6", "mean_error_mm"] == "mm"
    assert not dictionary.str.contains("%").any()


def test_covariance_is_that_of_the_calibration() -> None:
    calibration = record().calibration
    assert calibration is not None
    parameters = calibration.laser_ranger.parameters
    table = session_tables(REFERENCE)["covariance"]
    names = list(parameters.names)
    first = [names.index(name) for name in table["parameter_1"]]
    second = [names.index(name) for name in table["parameter_2"]]
    matrix = np.zeros((len(names), len(names)))
    matrix[first, second] = matrix[second, first] = table["covariance"]
    np.testing.assert_array_equal(matrix, parameters.covariance_array)


def test_an_edited_calibration_is_not_exported(tmp_path: Path) -> None:
    session = copied(tmp_path)
    edit_calibration(session)
    with pytest.raises(BadInputError):
        session_tables(session)


def test_the_cross_validation_has_a_row_for_each_placement() -> None:
    table = session_tables(REFERENCE)["cross_validation"]
    standoffs_mm = set(session_tables(REFERENCE)["residuals"]["standoff_mm"])
    assert set(table["standoff_mm"]) == standoffs_mm
    assert not table["alarm"].any()


def test_a_session_without_calibration_has_its_readings() -> None:
    tables = session_tables(Path(DATA / "simulation-0.1.0"))
    assert "parameters" not in tables
    assert "captures" in tables
