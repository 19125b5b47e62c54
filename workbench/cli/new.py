"""`workbench new`."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

from workbench.model.errors import BadInputError

PARTS = ("procedures", "rigs")
"""Folders that a laboratory starts from."""

DEMO = (
    "workbench run procedures/calibrate-flat.yaml procedures/accuracy-flat.yaml"
    " --rig rigs/thesis-emulated.yaml"
)
NOT_COPIED = shutil.ignore_patterns("build", "__pycache__")


def lay_out(folder: Path) -> str:
    """Copy the procedures, rigs and firmware of this version into `folder`, and return the next commands.

    Raises:
        BadInputError: the folder is not empty, or cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"{folder}: expected a new or empty folder, found files; nothing was written")
        for part in PARTS:
            shutil.copytree(
                _templates() / part, folder / part, ignore=NOT_COPIED, copy_function=shutil.copyfile
            )
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    return "\n".join(
        (f"{folder}: procedures and rigs written. Next:", f"cd {shlex.quote(str(folder))}", DEMO)
    )


def _templates() -> Path:
    """Folder with `PARTS`: package data of an installed workbench, the repository of an editable one."""
    package = Path(__file__).parents[1]
    installed = package / "templates"
    return installed if installed.is_dir() else package.parent
