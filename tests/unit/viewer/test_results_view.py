"""Recording of results without a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.viewer.readback import Contents, layout_views
from workbench.model.chart import Axis, Chart, Series
from workbench.model.table import Column, Table
from workbench.viewer.results_view import record_results
from workbench.viewer.table_text import WIDTH

TABLE = Table(
    name="counts",
    title="Counts of sensors",
    columns=(Column(key="what", name="what"), Column(key="n", name="number")),
    rows=(("passed", 12),),
)


def chart(name: str, *y: float) -> Chart:
    series = Series(name="L1", x=tuple(range(len(y))), y=y)
    return Chart(name=name, title=f"Title of {name}", x=Axis(label="x"), y=Axis(label="y"), series=(series,))


def test_every_table_and_chart_is_in_a_view(tmp_path: Path) -> None:
    out = tmp_path / "r.rrd"
    charts = [chart("one", 1.0, 2.0), chart("two", 3.0), chart("empty")]
    record_results(out, "study", "12 sensors pass, " * 9, [TABLE], charts, {"L1": "#ff0000"})
    contents, views = Contents(out), layout_views(out)
    assert len(views) == 4
    assert all(contents.below(view.origin) for view in views)
    assert {f"Title of {name}" for name in ("one", "two", "empty")} <= {view.name for view in views}
    ((text,),) = contents.static("/trials/study/tables", "TextDocument:text")
    assert text.startswith("12 sensors pass")
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "Counts of sensors" in text
    assert not list(tmp_path.glob("*.partial"))


def test_tables_alone_have_a_screen(tmp_path: Path) -> None:
    out = tmp_path / "r.rrd"
    record_results(out, "study", "nothing", [TABLE], [], {})
    assert [view.origin for view in layout_views(out)] == ["/trials/study/tables"]


def test_a_file_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="missing"):
        record_results(tmp_path / "missing" / "r.rrd", "study", "", [TABLE], [], {})
