"""Tables as plain text."""

from __future__ import annotations

from workbench.model.table import Column, Table
from workbench.viewer.table_text import WIDTH, table_text


def test_a_table_in_a_font_of_one_width() -> None:
    table = Table(
        name="t",
        title="Parameters",
        columns=(
            Column(key="name", name="parameter"),
            Column(key="value", name="value", unit="mm", format="+.1f"),
            Column(key="alarm", name="alarm"),
        ),
        rows=(("x", 1.25, True), ("longer_name", -100.0, False)),
        caption="alarm: farther off than expected of it",
    )
    assert table_text(table).splitlines() == [
        "Parameters",
        "",
        "              value",
        "parameter      (mm)  alarm",
        "──────────────────────────",
        "x              +1.2  !",
        "longer_name  -100.0",
        "",
        "alarm: farther off than",
        "expected of it",
    ]


def test_a_wide_table_is_split_into_blocks_and_long_texts_are_wrapped() -> None:
    columns = (
        Column(key="mm", name="true", unit="mm"),
        *(Column(key=f"c{n}", name=f"c{n}", format=".0f") for n in range(9)),
    )
    note = "a long note " * 12
    rows = ((300, *(1234567890 + n for n in range(8)), note),)
    lines = table_text(
        Table(name="t", title="T " * 60, columns=columns, rows=rows, caption=note)
    ).splitlines()
    assert max(map(len, lines)) <= WIDTH
    words = [word for line in lines for word in line.split()]
    assert words.count("300") == 2
    assert {str(1234567890 + n) for n in range(8)} <= set(words)
    assert words.count("note") == 24


def test_a_column_without_any_text_takes_no_place() -> None:
    columns = (Column(key="a", name="a"), Column(key="b", name=""), Column(key="c", name="c"))
    table = Table(name="t", title="T", columns=columns, rows=(("x", "", "y"),))
    assert table_text(table).splitlines()[-1] == "x    y"
