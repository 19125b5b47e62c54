"""Pictures of the documentation show what the workbench shows now: docs/decisions/0011."""

from __future__ import annotations

import json

import pytest

from tests.viewer.manifest import (
    CHARTS,
    DRAWINGS,
    IMAGES,
    MANIFEST,
    chart_svg,
    file_hash,
    names,
    path_of,
    shown_by,
)


@pytest.mark.parametrize("name", names())
def test_a_picture_is_that_of_its_command_and_not_stale(name: str) -> None:
    """Make a stale one by `make pictures`, the certificate by `make certificate`."""
    recorded = json.loads(MANIFEST.read_text())[name]
    assert recorded["sha256"] == file_hash(path_of(name))
    assert recorded["shows"] == shown_by(name)


@pytest.mark.parametrize("name", CHARTS)
def test_a_chart_is_drawn_from_its_stored_data(name: str) -> None:
    assert (IMAGES / f"{name}.svg").read_bytes() == chart_svg(name)


def test_every_picture_is_made_by_a_command_or_drawn_by_hand() -> None:
    made = {path_of(name).name for name in names()} | {f"{name}.svg" for name in CHARTS} | set(DRAWINGS)
    assert {path.name for path in IMAGES.iterdir()} - {MANIFEST.name} == made - {"certificate-demo.pdf"}
    assert set(json.loads(MANIFEST.read_text())) == set(names())
