"""Documents about a fit and a trial: what is listed, and what is left out where there is nothing."""

from __future__ import annotations

from tests.support.viewer_stream import a_reading
from tests.viewer.session import a_fit
from workbench.viewer.documents import fit_summary, without_range


def test_the_verdict_comes_first_and_every_reason_and_warning_is_an_item() -> None:
    fit = a_fit().model_copy(update={"reasons": ("one", "two"), "warnings": ("three",)})
    lines = fit_summary(fit).splitlines()
    assert fit.verdict in lines[0]
    assert [line for line in lines if line.startswith("- ")] == ["- one", "- two", "- three"]


def test_without_reasons_there_is_no_list_of_them() -> None:
    bare = a_fit().model_copy(update={"reasons": (), "warnings": ()})
    blocks = fit_summary(bare).split("\n\n")
    assert len(blocks) == 2
    assert f"{bare.rms_px:.3f} px" in blocks[1]
    assert f"{bare.observations}" in blocks[1]


def test_readings_without_a_range_are_listed_with_standoff_and_cause() -> None:
    readings = [a_reading(300.0, 301.0), a_reading(4500.0, None, reading=7)]
    _, *rows = without_range(readings).splitlines()
    (row,) = rows
    assert "4500 mm" in row
    assert "7" in row
    assert "no spot was seen" in row


def test_where_all_have_a_range_nothing_is_said() -> None:
    assert without_range([a_reading(300.0, 301.0)]) == ""
    assert without_range([]) == ""
