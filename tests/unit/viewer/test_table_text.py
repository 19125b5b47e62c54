"""Tables as plain text."""

from __future__ import annotations

from workbench.model.table import Column, Table
from workbench.viewer.table_text import table_text


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
