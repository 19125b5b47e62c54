"""Documents as JSON: unscaled values, items that are not stated as null."""

from __future__ import annotations

import json

from tests.support.reference_session import certificate
from workbench.model.laboratory import Laboratory


def test_items_that_are_not_stated_are_null_in_json() -> None:
    found = certificate(Laboratory(format=1)).document.as_json()
    sections = {section["key"]: section for section in json.loads(json.dumps(found))["sections"]}
    assert sections["laboratory"]["facts"]["Customer"] is None
    assert sections["sensor"]["facts"]["Serial number"] == "reference-1"


def test_tables_have_unscaled_records_and_units() -> None:
    sections = json.loads(json.dumps(certificate().document.as_json()))["sections"]
    (table,) = next(one for one in sections if one["key"] == "range_uncertainty")["tables"]
    row = next(one for one in table["rows"] if one["range_mm"] == 500)
    assert row["mean_relative_expanded"] * 500 == row["mean_expanded_mm"]
    assert table["units"]["mean_expanded_mm"] == "mm"
    assert table["units"]["mean_relative_expanded"] == "1"
