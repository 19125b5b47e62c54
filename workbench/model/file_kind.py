"""Kind of a file that is no table, by its first bytes or its keys, for messages about a wrong file."""

from __future__ import annotations

import re

from workbench.model.contents import not_text
from workbench.model.yamlfile import KINDS

CALIBRATION = f"{KINDS['laser_ranger']} (YAML)"
"""Kind of a calibration file."""
JOURNAL_START = b'{"n":'
"""First bytes of a session's journal."""
KEY = re.compile(rb"^([a-z_]+):(?:\s|$)", re.MULTILINE)
"""Key of a YAML file's outermost mapping."""
MOST_BYTES = 2**16
"""Length of the part that is searched for keys."""


def kind_of_content(content: bytes) -> str | None:
    """Kind of a file that is no table of this workbench, such as `a JPEG image` or `a calibration (YAML)`.

    Args:
        content: bytes of the file.

    Returns:
        None for text without a known beginning or key.
    """
    if (kind := not_text(content)) is not None:
        return kind
    if content.startswith(JOURNAL_START):
        return "the journal of a session; name the session's folder"
    keys = {key.decode("ascii") for key in KEY.findall(content[:MOST_BYTES])}
    return " and ".join(f"{name} (YAML)" for key, name in KINDS.items() if key in keys) or None
