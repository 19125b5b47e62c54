"""Rig files as texts that need no other file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.campaigns import RIG
from workbench.campaign.rig_input import read_rig, rig_of
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig


def test_the_text_gives_the_rig() -> None:
    assert rig_of(read_rig(RIG)) == load_rig(RIG)


def test_a_rig_without_lasers_is_refused(tmp_path: Path) -> None:
    text = RIG.read_text()
    path = tmp_path / "rig.yaml"
    path.write_text(text[: text.index("\nlasers:")] + text[text.index("\nbench:") :])
    with pytest.raises(BadInputError, match="at least one laser"):
        read_rig(path)
