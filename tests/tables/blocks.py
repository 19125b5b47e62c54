"""Marked blocks of Markdown pages, whose contents are made by a command.

A block is

    <!-- table: NAME -->

    contents

    <!-- end of table -->
"""

from __future__ import annotations

import re
from collections.abc import Mapping

END = "<!-- end of table -->"
BLOCK = re.compile(
    rf"(<!-- table: (?P<name>[\w-]+) -->)\n\n(?:(?P<text>(?:(?!<!-- ).)+?)\n\n)?{END}", re.DOTALL
)
MARK = re.compile(r"<!-- (?:table: |end of table)")


def blocks(page: str) -> dict[str, str]:
    """Contents of all blocks of a page by their names.

    Raises:
        ValueError: a mark has no partner, or a name occurs twice.
    """
    found = list(BLOCK.finditer(page))
    names = [block["name"] for block in found]
    if len(MARK.findall(page)) != 2 * len(found) or len(set(names)) != len(names):
        raise ValueError("expected pairs of <!-- table: NAME --> and <!-- end of table -->, each name once")
    return {block["name"]: block["text"] or "" for block in found}


def with_contents(page: str, contents: Mapping[str, str]) -> str:
    """The page with other contents of all its blocks.

    Raises:
        LookupError: a block has a name that is not in `contents`.
    """
    return BLOCK.sub(lambda block: f"{block[1]}\n\n{contents[block['name']]}\n\n{END}", page)


def without_blocks(page: str) -> str:
    """The page without its blocks."""
    return BLOCK.sub("", page)
