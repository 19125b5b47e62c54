"""HTML pages: every text escaped, equal but for the time of printing, legible in a real browser."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.browser import headless_browser
from tests.support.reference_session import MARKUP, certificate
from workbench.model.table import Column, Table
from workbench.report.document import Document, Fact, KeyNumber, Section, Verdict
from workbench.report.document_html import MOST_ROWS, document_html

TITLE = re.compile(r"<title>(.*?)</title>")
WIDER_THAN_PAGE = (
    "({wide: [...document.querySelectorAll('td, th, h1, h2, p, svg, figcaption')].filter("
    "e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'none').length,"
    " page: document.documentElement.scrollWidth, tables: document.querySelectorAll('table.data').length,"
    " charts: [...document.querySelectorAll('figure.chart svg')].filter(e =>"
    " e.getBoundingClientRect().height > 100).length})"
)


def document(*tables: Table, name: str = MARKUP) -> Document:
    section = Section(name, name, (Fact(name, name),), (name,), tables)
    verdict = Verdict("open", name, (name,))
    return Document(
        name, name, name, (Fact(name, name),), verdict, (KeyNumber(name, name, name),), (section,)
    )


def table(rows: int, columns: int) -> Table:
    return Table(
        name="t",
        title=MARKUP,
        columns=tuple(Column(key=f"c{n}", name=f"{MARKUP}{n}", unit=MARKUP) for n in range(columns)),
        rows=tuple((MARKUP, *(float(n) for n in range(columns - 1))) for _ in range(rows)),
        caption=MARKUP,
    )


def test_rows_without_a_value_in_a_block_of_columns_are_left_out_of_it() -> None:
    columns = [Column(key=f"c{n}", name=f"a rather long heading {n}") for n in range(14)]
    names, filled = ("left", "right", "none"), (range(1, 3), range(12, 14), range(0))
    rows = [
        (name, *("value" * 3 if n in own else None for n in range(1, 14)))
        for name, own in zip(names, filled, strict=True)
    ]
    wide = document_html(document(Table(name="t", title="t", columns=columns, rows=rows)), "now")
    narrow = Table(name="t", title="t", columns=columns[:3], rows=[row[:3] for row in rows])
    assert [wide.count(f">{name}<") for name in names] == [1, 1, 0]
    assert [document_html(document(narrow), "now").count(f">{name}<") for name in names] == [1, 1, 1]


def test_markup_in_any_text_is_escaped() -> None:
    page = document_html(document(table(3, 3)), MARKUP)
    assert "<script>" not in page
    assert page.count("&lt;script&gt;") > 20


def test_two_prints_differ_in_the_time_of_printing_only() -> None:
    first, second = (document_html(certificate().document, f"printed {n}") for n in (1, 2))
    assert first != second
    assert first == second.replace("printed 2", "printed 1")


def test_a_page_needs_nothing_else() -> None:
    page = document_html(certificate().document, "now")
    outside = [link for link in re.findall(r'(?:src|href)="([^"]*)"', page) if not link.startswith("#")]
    assert outside == []
    assert "url(#" in page or "url(" not in page


def test_long_tables_end_with_a_remark() -> None:
    page = document_html(document(table(MOST_ROWS + 7, 2), name="x"), "now")
    assert page.count("<tr><td>") == MOST_ROWS
    assert f"of {MOST_ROWS + 7} rows" in page


def test_wide_tables_are_split_into_blocks_that_repeat_the_names_of_rows() -> None:
    wide = Table(
        name="t",
        title="t",
        columns=tuple(Column(key=f"c{n}", name=f"column {n}") for n in range(100)),
        rows=(("a", "x", *range(98)), ("a", "y", *range(98))),
    )
    page = document_html(document(wide, name="x"), "now")
    blocks = page.count('<table class="data">')
    assert blocks > 5
    assert page.count("<td>a</td><td>x</td>") == blocks
    assert all(page.count(f"column {n}<") == 1 for n in range(2, 100))


@pytest.mark.long_cases
@pytest.mark.parametrize("many", [False, True])
def test_nothing_is_cut_off_in_a_browser(many: bool, tmp_path: Path) -> None:
    """Many lasers are 100 columns, many placements 500 rows."""
    shown = document(table(500, 100), name="x") if many else certificate().document
    page = tmp_path / "page.html"
    page.write_text(document_html(shown, "now"))
    with headless_browser(tmp_path, 1200, 900) as browser:
        browser.open(page.as_uri())
        measured = browser.value_of(WIDER_THAN_PAGE)
    assert measured["wide"] == 0
    assert measured["page"] <= 1200
    assert measured["tables"] >= 8
    assert measured["charts"] == sum(len(section.charts) for section in shown.sections)
