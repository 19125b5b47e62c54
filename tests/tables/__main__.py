"""`make tables`: write all tables of the documentation that a command makes."""

from __future__ import annotations

from tests.support.stored_output import ROOT
from tests.tables.blocks import with_contents
from tests.tables.contents import PAGES, TABLES


def main() -> None:
    """Write the pages that differ, and print their names."""
    contents = {name: make() for name, make in TABLES.items()}
    for name in PAGES:
        page = ROOT / name
        before = page.read_text()
        after = with_contents(before, contents)
        if after != before:
            page.write_text(after)
            print(f"{name} written")


if __name__ == "__main__":
    main()
