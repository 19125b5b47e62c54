"""Rig files as arguments."""

from __future__ import annotations

from pathlib import Path

from workbench.model.rig import Rig, load_rig


def rig_of(rig: str | Path | Rig) -> Rig:
    """The rig itself, or the contents of its file.

    Raises:
        BadInputError: the file is missing or wrong.
    """
    return rig if isinstance(rig, Rig) else load_rig(Path(rig))
