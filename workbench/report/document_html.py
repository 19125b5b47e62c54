"""HTML page of a document: self-contained, every text escaped, equal documents give equal pages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from workbench.figures.figure import svg
from workbench.model.chart import Chart
from workbench.model.table import ALARM, MISSING, Table
from workbench.model.table_layout import GAP, TextColumn, blocks, text_columns
from workbench.report.document import Document, Fact

TEMPLATE, STYLE = "document.html.j2", "document.css"
WIDTH_CHARACTERS = 104
"""Width of a page in characters of a table; wider tables are split into blocks of columns."""
HASH_KEY = "sha256"
LONG_WORD = 60
"""Number of letters of a word above which the cells of its column break words."""
LONGEST_WORD = 300
"""Largest number of letters of a word on the page: the time of a PDF grows with its square."""
WORD = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")
MOST_ROWS = 600
"""Largest number of rows of a table on the page; `workbench export` writes all."""


@dataclass(frozen=True)
class HtmlColumn:
    """One column of a block."""

    name: str
    unit: str
    cells: tuple[str, ...]
    is_number: bool
    kind: str
    """Class of its cells: `number`, `hash`, `long` (words), `alarm` or none."""


def document_html(document: Document, printed: str) -> str:
    """The page.

    Args:
        document: the document.
        printed: time of printing, the only part that differs between two prints.
    """
    folder = Path(__file__).parent
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=_shortened,
    )
    environment.filters |= {
        "svg": partial(_svg, document),
        "rows": _rows,
        "column_blocks": _column_blocks,
    }
    details = [table for section in document.sections for table in section.tables if table.is_detail]
    return environment.get_template(TEMPLATE).render(
        document=document,
        details=details,
        most_rows=MOST_ROWS,
        printed_fact=Fact("Issued", printed),
        style=Markup((folder / STYLE).read_text(encoding="utf-8")),  # noqa: S704 - our own file
    )


def _svg(document: Document, chart: Chart) -> Markup:
    """Chart as an element of the page. Its texts are outlines; matplotlib escapes their copies."""
    text = svg(chart, document.colors).decode()
    return Markup(text[text.index("<svg") :])  # noqa: S704 - matplotlib's output


def _column_blocks(table: Table) -> list[list[HtmlColumn]]:
    """Columns of a table in blocks that fit on a page; each block repeats the columns that name its rows."""
    texts = text_columns(table.model_copy(update={"rows": table.rows[:MOST_ROWS]}))
    described = {id(text): _html_column(table, index, text) for index, text in enumerate(texts)}
    first, *others = texts
    named = others[:1] if len(set(first.cells)) < len(first.cells) else []
    width = WIDTH_CHARACTERS - sum(text.width + GAP for text in named)
    parts = blocks([first, *others[len(named) :]], width)
    found = [[described[id(text)] for text in (first, *named, *part[1:])] for part in parts]
    return found if len(found) == 1 else [_without_empty_rows(block) for block in found]


def _without_empty_rows(block: list[HtmlColumn]) -> list[HtmlColumn]:
    """The block without the rows whose values are all in other blocks."""
    rows = [n for n, row in enumerate(_rows(block)) if any(cell not in {MISSING, ""} for _, cell in row[1:])]
    return [replace(column, cells=tuple(column.cells[n] for n in rows)) for column in block]


def _html_column(table: Table, index: int, text: TextColumn) -> HtmlColumn:
    column = table.columns[index]
    kind = "number" if text.is_number else "hash" if column.key == HASH_KEY else _kind_of_words(text.cells)
    if any(cell == ALARM for cell in text.cells):
        kind = "alarm"
    name, unit = (column.name, column.unit) if column.name else (column.unit, "")
    return HtmlColumn(name, unit, text.cells, text.is_number, kind)


def _kind_of_words(cells: Sequence[str]) -> str:
    return "long" if any(len(word) > LONG_WORD for cell in cells for word in cell.split()) else ""


def _shortened(value: object) -> object:
    """A value of the page, with an ellipsis in place of the end of overlong words; markup as it is."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return WORD.sub(lambda word: f"{word[0][: LONGEST_WORD - 1]}\N{HORIZONTAL ELLIPSIS}", value)


def _rows(columns: Sequence[HtmlColumn]) -> Iterator[list[tuple[HtmlColumn, str]]]:
    """Rows of a block, each cell with its column."""
    for cells in zip(*(column.cells for column in columns), strict=True):
        yield list(zip(columns, cells, strict=True))
