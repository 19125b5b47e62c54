"""Notebooks are kept without outputs, and use the public interface alone; nbmake runs them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def test_the_overview_links_every_notebook() -> None:
    overview = (ROOT / "notebooks/README.md").read_text()
    assert [path.name for path in NOTEBOOKS] == re.findall(r"\(([\w-]+\.ipynb)\)", overview)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_kept_without_outputs(path: Path) -> None:
    code = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert [cell["outputs"] for cell in code] == [[]] * len(code)
    assert {cell["execution_count"] for cell in code} == {None}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_imports_the_public_interface_alone(path: Path) -> None:
    cells = json.loads(path.read_text())["cells"]
    code = "".join(line for cell in cells if cell["cell_type"] == "code" for line in cell["source"])
    imported = re.findall(r"^\s*(?:import|from) (workbench\S*.*)$", code, flags=re.MULTILINE)
    assert imported == ["workbench as wb"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_its_links_lead_somewhere(path: Path) -> None:
    cells = json.loads(path.read_text())["cells"]
    text = "".join(line for cell in cells if cell["cell_type"] == "markdown" for line in cell["source"])
    for link in re.findall(r"\]\(([^)#\s]+)", text):
        assert (path.parent / link).exists(), link
