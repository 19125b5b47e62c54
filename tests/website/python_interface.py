"""Page of the Python interface, whose docstrings mkdocstrings inserts."""

from __future__ import annotations

import workbench

HEAD = """\
# Python reference

Docstrings of the public names. [Python interface](api.md) has examples and the columns of the data frames.
"""


def interface_page() -> str:
    """Markdown with one directive for each public name."""
    return "\n".join([HEAD, *(f"::: workbench.api.{name}\n" for name in workbench.__all__)])
