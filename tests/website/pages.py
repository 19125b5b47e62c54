"""Pages of the site, gathered in one folder with the paths that they have in the repository.

Links between files therefore hold on the site as they do on a code host.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.website.commands import commands_page
from tests.website.notebooks import write_notebook
from tests.website.python_interface import interface_page

ROOT = Path(__file__).parents[2]
COPIED = (
    "docs",
    "data/README.md",
    "data/aprilgrid-photos/LICENSE",
    "data/opencv-chessboards/LICENSE",
    "data/webcam-laser-rows.csv",
    "examples",
    "notebooks/README.md",
    "procedures",
    "rigs",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "LICENSE",
    "README.md",
    "tests/website/iframe-worker.js",
)
"""Files and folders of the repository that are pages, or that pages link."""
LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.pyc", "*.o", "*.elf", "*.hex")


def gather(folder: Path, *, run_notebooks: bool) -> None:
    """Write all pages into a folder, which is emptied first.

    Args:
        folder: where to write.
        run_notebooks: whether to run the notebooks, which takes a minute, and to show their figures.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for name in COPIED:
        source, target = ROOT / name, folder / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=LEFT_OUT)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        write_notebook(notebook, folder / "notebooks", run=run_notebooks)
    (folder / "docs/commands.md").write_text(commands_page())
    (folder / "docs/python-interface.md").write_text(interface_page())
    for page in folder.rglob("*.md"):
        page.write_text(page.read_text().replace(".ipynb)", ".md)"))
