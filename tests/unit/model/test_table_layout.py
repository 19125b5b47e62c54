"""Columns as text."""

from __future__ import annotations

from workbench.model.table import Column, Table
from workbench.model.table_layout import text_columns


def test_a_heading_is_wrapped_to_its_cells() -> None:
    one = Table(
        name="t",
        title="T",
        columns=(
            Column(key="a", name="information share", unit="%", scale=100, format=".0f"),
            Column(key="b", name="what it is"),
            Column(key="c", name=""),
        ),
        rows=((0.25, "quite a long text", True),),
    )
    share, words, alarm = text_columns(one)
    assert share.heading == ("information", "share (%)")
    assert (share.cells, share.is_number, share.width) == (("25",), True, 11)
    assert (words.heading, words.is_number, words.width) == (("what it is",), False, 17)
    assert (alarm.heading, alarm.cells, alarm.width) == (("",), ("!",), 1)
