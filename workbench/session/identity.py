"""Identity of a session by its content, which copies and links of its folder share."""

from __future__ import annotations

import hashlib
from pathlib import Path

from workbench.model.errors import BadInputError
from workbench.session.journal import JOURNAL
from workbench.session.manifest import load_manifest

LONGEST_RECORD_BYTES = 2**20
"""Part of a journal's first record that counts; records have some hundred bytes."""


def session_identity(session_dir: Path) -> str:
    """Hash of the session's start time, serial number of its rig, and first record; empty if one is missing.

    The first record has its time in nanoseconds. Repairs and resumptions do not change any of the three.
    """
    try:
        manifest = load_manifest(session_dir)
    except BadInputError:
        return ""
    return identity_of(session_dir, manifest.created, manifest.rig.serial)


def identity_of(session_dir: Path, created: str, serial: str) -> str:
    """Identity of a session whose manifest has been read; empty without a first record."""
    try:
        with (session_dir / JOURNAL).open("rb") as journal:
            first = journal.readline(LONGEST_RECORD_BYTES)
    except OSError:
        return ""
    if not first.endswith(b"\n"):
        return ""
    return hashlib.sha256(f"{created}\n{serial}\n".encode() + first).hexdigest()
