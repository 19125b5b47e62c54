"""Rig files as inputs of a campaign: their texts, which need no other file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from workbench.model.rig import Rig, load_rig
from workbench.model.yamlfile import parse_yaml_model, standalone_text


def read_rig(path: Path) -> str:
    """Text of a rig file, with what it takes from other files.

    Raises:
        BadInputError: the file is missing or wrong, or the rig has no lasers.
    """
    load_rig(path)
    return standalone_text(path, Rig)


@lru_cache(maxsize=16)
def rig_of(text: str) -> Rig:
    """The rig of such a text."""
    return parse_yaml_model(text, Path("rig of the campaign"), Rig)
