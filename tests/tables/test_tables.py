"""Tables of the documentation are those that their commands make."""

from __future__ import annotations

import re

import pytest

from tests.support.stored_output import FOLDER, ROOT, newest
from tests.tables.blocks import blocks, with_contents, without_blocks
from tests.tables.contents import PAGES, TABLES
from tests.tables.markdown import markdown_table

MARKED = {name: page for page in PAGES for name in blocks((ROOT / page).read_text())}
"""Page of each table."""
NUMBER = re.compile(r"[-+]?\d[\d.,/ %+*-]*(NO)?$")
STATED = {
    "docs/laser-controller.md": "times that the controller and the guardian keep; tests measure them",
    "docs/ranging.md": "defaults of the prior",
    "docs/decisions": "records of their day",
}
"""Pages and folders with tables of numbers that no command makes, and why."""


def test_every_table_is_on_one_page() -> None:
    marks = [name for page in PAGES for name in blocks((ROOT / page).read_text())]
    assert sorted(marks) == sorted(TABLES)


@pytest.mark.parametrize("name", sorted(TABLES))
def test_a_table_is_what_its_command_makes(name: str) -> None:
    """Write a stale one by `make tables`."""
    assert blocks((ROOT / MARKED[name]).read_text())[name] == TABLES[name]()


def test_no_other_page_has_marks_or_a_table_of_measured_numbers() -> None:
    found = []
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")):
        name = str(page.relative_to(ROOT))
        text = without_blocks(page.read_text())
        has_mark = re.search("^<!-- ", text, re.MULTILINE)
        if has_mark or (_has_numbers(text) and not _is_stated(name)):
            found.append(name)
    assert found == []


def test_stored_outputs_state_command_and_code() -> None:
    subjects = {path.stem[11:] for path in FOLDER.glob("*.txt")}
    assert {subject for subject in subjects if not newest(subject).command} == set()


def test_contents_are_replaced_between_the_marks() -> None:
    page = "a\n\n<!-- table: one -->\n\nold\n\n<!-- end of table -->\n\nb\n"
    assert blocks(page) == {"one": "old"}
    assert with_contents(page, {"one": "new"}) == page.replace("old", "new")
    assert with_contents(page, {"one": r"\1"}) == page.replace("old", r"\1")


def test_a_table_without_rows_is_refused() -> None:
    with pytest.raises(ValueError, match=r"rows for the table a \| b, got none"):
        markdown_table(("a", "b"), [])


def test_a_new_block_is_filled_and_ends_at_its_own_mark() -> None:
    new, old = "<!-- table: one -->\n\n", "<!-- table: two -->\n\nc\n\n"
    page = f"{new}<!-- end of table -->\n\nb\n\n{old}<!-- end of table -->\n"
    assert blocks(page) == {"one": "", "two": "c"}
    assert blocks(with_contents(page, {"one": "a", "two": "d"})) == {"one": "a", "two": "d"}
    assert "\n\nb\n\n" in with_contents(page, {"one": "a", "two": "d"})


@pytest.mark.parametrize(
    "page",
    [
        "<!-- table: one -->\n\nold\n",
        "old\n\n<!-- end of table -->\n",
        2 * "<!-- table: one -->\n\nold\n\n<!-- end of table -->\n",
    ],
)
def test_marks_without_partner_and_names_given_twice_are_refused(page: str) -> None:
    with pytest.raises(ValueError, match="pairs"):
        blocks(page)


def _has_numbers(text: str) -> bool:
    """Whether a table has more cells with numbers than without, headings and first column not counted."""
    for table in re.findall(r"(?:^\|.*\n?)+", text, flags=re.MULTILINE):
        rows = [line.strip("|").split("|")[1:] for line in table.splitlines()[2:]]
        cells = [cell.strip() for row in rows for cell in row]
        if 2 * sum(bool(NUMBER.match(cell)) for cell in cells) > len(cells):
            return True
    return False


def _is_stated(name: str) -> bool:
    return any(name == page or name.startswith(f"{page}/") for page in STATED)
