"""Manifest of a session, `session.yaml`: verbatim copies of its input files, versions and invocation."""

from __future__ import annotations

import io
import platform
from collections.abc import Sequence
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import LiteralScalarString

from workbench.model.bounds import RECORDED
from workbench.model.errors import BadInputError
from workbench.model.name import Name
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel, load_yaml_model, parse_yaml_model, standalone_text
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
    """Version of the running workbench."""
    return version(DISTRIBUTION)


class FileEntry(FileModel):
    """Input file of a session."""

    file: str
    text: str
    """Content, verbatim."""


class RigEntry(FileEntry):
    """Rig file of a session."""

    serial: Name


class CalibrationEntry(FileModel):
    """Existing calibration that a session uses; the session folder has a copy."""

    file: str
    sha256: str


class Manifest(BaseModel):
    """Manifest as read back. Sessions of version 0.1.0 may lack `command`."""

    created: str
    operator: str
    command: str = ""
    rig: RigEntry
    procedures: tuple[FileEntry, ...]
    calibration: CalibrationEntry | None = None
    versions: dict[str, str]


def create_session(
    folder: Path,
    rig: Rig,
    rig_path: Path,
    procedure_paths: Sequence[Path],
    *,
    operator: str,
    created: str,
    command: str,
    calibration: CalibrationEntry | None = None,
    procedure_model: type[FileModel] = FileModel,
) -> None:
    """Create the session folder with its manifest.

    Files that a procedure names, as known by `procedure_model`, are written out in its copy.

    Raises:
        BadInputError: the folder exists or cannot be created.
    """
    try:
        folder.mkdir(parents=True)
        (folder / "frames").mkdir()
    except OSError as error:
        raise BadInputError(f"{folder}: the session folder cannot be created: {error.strerror}") from None
    caller = {"created": created, "operator": operator, "command": command}
    entry = RigEntry(file=str(rig_path.resolve()), text=standalone_text(rig_path, Rig), serial=rig.serial)
    procedures = [
        FileEntry(file=str(path.resolve()), text=standalone_text(path, procedure_model))
        for path in procedure_paths
    ]
    _write(folder, caller, entry, procedures, calibration)


def replace_manifest(folder: Path, before: Manifest, rig: RigEntry, procedures: Sequence[FileEntry]) -> None:
    """Replace the manifest by one with other files; the previous one is kept as `session-<number>.yaml`."""
    number = next(n for n in count(1) if not (folder / f"session-{n}.yaml").exists())
    write_record(folder / f"session-{number}.yaml", (folder / MANIFEST).read_bytes())
    caller = {"created": before.created, "operator": before.operator, "command": before.command}
    _write(folder, caller, rig, procedures, before.calibration)


def load_manifest(session_dir: Path) -> Manifest:
    """Read the manifest.

    Raises:
        BadInputError: `session_dir` is no session folder, or its manifest is damaged.
    """
    if not (session_dir / MANIFEST).is_file():
        got = f"a folder without {MANIFEST}" if session_dir.is_dir() else "no such folder"
        raise BadInputError(f"{session_dir}: expected a session folder, got {got}")
    return load_yaml_model(session_dir / MANIFEST, Manifest)


def recorded_versions() -> dict[str, str]:
    """Versions of Python and of the libraries that determine a session's results."""
    return {"python": platform.python_version()} | {n: version(n) for n in RECORDED_VERSIONS}


def _write(
    folder: Path,
    caller: dict[str, str],
    rig: RigEntry,
    procedures: Sequence[FileEntry],
    calibration: CalibrationEntry | None,
) -> None:
    manifest: dict[str, Any] = {
        "format": 1,
        "session": folder.name,
        **caller,
        "rig": {"file": rig.file, "serial": rig.serial, "text": LiteralScalarString(rig.text)},
        "procedures": [{"file": p.file, "text": LiteralScalarString(p.text)} for p in procedures],
        "versions": recorded_versions(),
    }
    if calibration is not None:
        manifest["calibration"] = calibration.model_dump()
    stream = io.StringIO()
    YAML().dump(manifest, stream)
    write_record(folder / MANIFEST, stream.getvalue().encode())


def load_session_rig(session_dir: Path, *, bounded: bool = False) -> Rig:
    """Rig of a session, from the copy in its manifest.

    Args:
        session_dir: session folder.
        bounded: whether the bounds of rig files apply, as for a computation; a recorded rig is shown without.

    Raises:
        BadInputError: `session_dir` is no session folder, or its manifest is damaged.
    """
    text = load_manifest(session_dir).rig.text
    context = None if bounded else RECORDED
    return parse_yaml_model(text, Path(f"{session_dir / MANIFEST} (rig)"), Rig, context)
