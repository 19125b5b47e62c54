"""Packages with drivers, as a lab would have them, installed into a folder that a test puts on the path."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples/laser_driver"


def install_example(folder: Path) -> None:
    """Install the example laser driver into `folder`, by pip and without a network."""
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check", "--quiet"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(folder), str(EXAMPLE)]
    subprocess.run(command, check=True, timeout=300)


def write_driver(
    folder: Path, module: str, source: str, entry_points: Mapping[str, Mapping[str, str]]
) -> None:
    """Put a module with drivers into `folder` as pip does.

    Args:
        folder: where; made if missing.
        module: name of the module.
        source: its text.
        entry_points: by group, from an entry point's name to what it names.
    """
    metadata = folder / f"{module}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (folder / f"{module}.py").write_text(source)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    groups = (
        "\n".join([f"[{group}]", *(f"{name} = {what}" for name, what in named.items())])
        for group, named in entry_points.items()
    )
    (metadata / "entry_points.txt").write_text("\n".join(groups) + "\n")


def put_on_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process and those that it starts import what is installed in `folder`."""
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), str(ROOT)]))
