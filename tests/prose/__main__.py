"""`python -m tests.prose [PATH...]`: print findings; exit code 1 where there are any."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from tests.prose.lint import lint, load_rules

ROOT = Path(__file__).parents[2]


def main() -> int:
    """Lint the paths of the command line, or the whole repository."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files or folders; default: all")
    paths: list[Path] = parser.parse_args().paths
    rules = load_rules()
    if not paths:
        os.chdir(ROOT)
        paths = [Path(path) for path in rules.paths]
    found = lint(paths, rules)
    for item in found:
        print(item)
    print(f"prose: {len(found)} findings", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
