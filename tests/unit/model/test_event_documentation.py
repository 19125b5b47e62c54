"""docs/journal-format.md lists every kind of record with every field, and no other."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import pytest

from workbench.model.event import Event

PAGE = (Path(__file__).parents[3] / "docs/journal-format.md").read_text()
KINDS = {kind.model_fields["kind"].default: kind for kind in get_args(get_args(Event)[0])}


def test_every_kind_of_record_has_its_section() -> None:
    assert re.findall(r"^### (\w+)$", PAGE, re.MULTILINE) == list(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_has_its_row(kind: str) -> None:
    section = PAGE.split(f"### {kind}\n")[1].split("\n### ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (\S.*) \|$", section, re.MULTILINE)
    assert [name for name, _ in rows] == [name for name in KINDS[kind].model_fields if name != "kind"]
