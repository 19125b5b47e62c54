"""Notebooks as pages: text, code, and the results of a run."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

SECONDS = 300
"""Longest time of one cell."""


def write_notebook(notebook: Path, folder: Path, *, run: bool) -> None:
    """Write the page of a notebook, and its figures beside it.

    Args:
        notebook: the `.ipynb` file.
        folder: where to write.
        run: whether to run it, in the folder where it stands.
    """
    content = nbformat.reads(notebook.read_text(), as_version=4)
    if run:
        NotebookClient(content, timeout=SECONDS, resources={"metadata": {"path": notebook.parent}}).execute()
    parts = [part for cell in content.cells for part in _cell(cell, folder, notebook.stem)]
    (folder / f"{notebook.stem}.md").write_text("\n\n".join(parts) + "\n")


def _cell(cell: Any, folder: Path, stem: str) -> Iterator[str]:
    if cell.cell_type == "markdown":
        yield cell.source
        return
    yield f"```python\n{cell.source}\n```"
    for number, output in enumerate(cell.outputs):
        yield from _output(output, folder, f"{stem}-{cell.id}-{number}")


def _output(output: Any, folder: Path, name: str) -> Iterator[str]:
    data = output.get("data", {})
    if "image/png" in data:
        (folder / f"{name}.png").write_bytes(base64.b64decode(data["image/png"]))
        yield f"![Figure drawn by the code above]({name}.png)"
    elif "text/html" in data:
        # A blank line would end the block; scoped styles of pandas are of no use here.
        table = re.sub(r"<style.*?</style>", "", data["text/html"], flags=re.DOTALL)
        yield re.sub(r"\n\s*\n", "\n", table)
    elif text := data.get("text/plain") or (output.get("text") if output.get("name") == "stdout" else ""):
        yield f"```text\n{text.rstrip()}\n```"
