"""Build the site: `python -m tests.website [--without-figures] [FOLDER]`; every warning is an error.

FOLDER gets the configuration, the gathered pages, and the site.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.website.build import build
from tests.website.pages import ROOT, gather


def main() -> int:
    """Gather the pages and build; returns the exit code of MkDocs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build/website")
    parser.add_argument("--without-figures", action="store_true", help="do not run the notebooks")
    asked = parser.parse_args()
    gather(asked.folder / "pages", run_notebooks=not asked.without_figures)
    done = build(asked.folder)
    print(done.stderr if done.returncode else f"{asked.folder / 'site/index.html'} written")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
