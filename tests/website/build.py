"""Strict build of gathered pages by MkDocs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

CONFIG = Path(__file__).with_name("mkdocs.yml")


def build(folder: Path) -> subprocess.CompletedProcess[str]:
    """Build `folder/site` from `folder/pages`; warnings, such as broken links, are errors.

    `--quiet` would hide warnings from the strict mode too.
    """
    config = shutil.copy(CONFIG, folder)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(config)]
    # Material announces its end of life, and that of MkDocs 1: docs/decisions/0010-documentation-site.md.
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(  # no shell
        command, env=environment, capture_output=True, text=True, check=False
    )
