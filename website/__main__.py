"""Build the site: `python -m website [--without-figures] [FOLDER]`; every warning is an error.

FOLDER gets the configuration, the gathered pages, and the site.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from website.pages import ROOT, gather

CONFIG = Path(__file__).with_name("mkdocs.yml")


def main() -> int:
    """Gather the pages and build; returns the exit code of MkDocs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build/website")
    parser.add_argument("--without-figures", action="store_true", help="do not run the notebooks")
    asked = parser.parse_args()
    gather(asked.folder / "pages", run_notebooks=not asked.without_figures)
    config = shutil.copy(CONFIG, asked.folder)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(config)]
    # Material announces its end of life, and that of MkDocs 1: docs/decisions/0009-documentation-site.md.
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(command, env=quiet, check=False).returncode  # noqa: S603  # no shell


if __name__ == "__main__":
    sys.exit(main())
