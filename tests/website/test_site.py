"""The documentation site builds strictly, needs no other server, and can be searched as files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import workbench
from tests.support.browser import headless_browser
from tests.website.build import build
from tests.website.pages import gather

SEARCH_S = 30.0
OTHER_SERVER = re.compile(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=\"(https?:)?//")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("website")
    gather(folder / "pages", run_notebooks=False)
    done = build(folder)
    assert done.returncode == 0, done.stderr
    return folder / "site"


def test_pages_load_nothing_from_another_server(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 60
    assert [page for page in pages if OTHER_SERVER.search(page.read_text())] == []


def test_reference_has_every_command_and_every_public_name(site: Path) -> None:
    entries = json.loads((site / "search/search_index.json").read_text())["docs"]
    places = {entry["location"] for entry in entries}
    for command in ("run", "fit", "lasers-off"):
        assert f"docs/commands.html#workbench-{command}" in places
    for name in workbench.__all__:
        assert any(
            place.startswith("docs/python-interface.html#") and place.endswith(f".{name}") for place in places
        ), name


def test_search_works_in_files(site: Path, tmp_path: Path) -> None:
    with headless_browser(tmp_path) as browser:
        browser.open(f"{(site / 'docs/theory/limits.html').as_uri()}?q=speckle")
        count = "document.querySelectorAll('.md-search-result__item').length"
        browser.wait_for(lambda _: browser.value_of(count) > 5, SEARCH_S)


def test_a_broken_link_and_a_missing_anchor_fail(tmp_path: Path) -> None:
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages/README.md").write_text("# A\n\n[broken](nowhere.md), [missing](#nowhere)\n")
    done = build(tmp_path)
    assert done.returncode != 0
    assert "nowhere.md" in done.stderr
    assert "#nowhere" in done.stderr
