"""`session.yaml`: everything that a session started from, word for word."""

from __future__ import annotations

import io
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import LiteralScalarString

from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.yamlfile import load_yaml_model, parse_yaml_model
from workbench.session.files import write_record

MANIFEST = "session.yaml"
DISTRIBUTION = "laser-range-workbench"
RECORDED_VERSIONS = (
    DISTRIBUTION,
    "jax",
    "numpy",
    "opencv-contrib-python-headless",
    "optimistix",
    "rerun-sdk",
)


def workbench_version() -> str:
    """Version of the workbench that is running."""
    return version(DISTRIBUTION)


def create_session(
    folder: Path, rig: Rig, rig_path: Path, procedure_paths: Sequence[Path], *, operator: str, created: str
) -> None:
    """Create the session folder with its manifest.

    Raises:
        BadInputError: the folder exists or cannot be made.
    """
    try:
        folder.mkdir(parents=True)
        (folder / "frames").mkdir()
    except OSError as error:
        raise BadInputError(f"{folder}: the session folder cannot be made: {error.strerror}") from None
    manifest: dict[str, Any] = {
        "format": 1,
        "session": folder.name,
        "created": created,
        "operator": operator,
        "rig": {"file": str(rig_path), "serial": rig.serial, "text": _verbatim(rig_path)},
        "procedures": [{"file": str(path), "text": _verbatim(path)} for path in procedure_paths],
        "versions": {"python": platform.python_version()} | {n: version(n) for n in RECORDED_VERSIONS},
    }
    stream = io.StringIO()
    YAML().dump(manifest, stream)
    write_record(folder / MANIFEST, stream.getvalue().encode())


def load_session_rig(session_dir: Path) -> Rig:
    """The rig as it was when the session began.

    Raises:
        BadInputError: this is no session folder, or its manifest is damaged.
    """
    path = session_dir / MANIFEST
    text = load_yaml_model(path, _Manifest).rig.text
    return parse_yaml_model(text, Path(f"{path} (rig)"), Rig)


class _RigEntry(BaseModel):
    text: str


class _Manifest(BaseModel):
    """What is read back of the manifest."""

    rig: _RigEntry


def _verbatim(path: Path) -> str:
    text: str = LiteralScalarString(path.read_text(encoding="utf-8"))
    return text
