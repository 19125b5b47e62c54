"""`python -m tests.prose [PATH...]`: print findings; exit code 1 where there are any.

Without a path, the findings of packages that `rules.toml` lists as not clean are only counted.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from pathlib import Path

from tests.prose.lint import Finding, lint, load_rules

ROOT = Path(__file__).parents[2]


def main() -> int:
    """Lint the paths of the command line, or the whole repository."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files or folders; default: all")
    paths: list[Path] = parser.parse_args().paths
    rules = load_rules()
    if paths:
        return _report(lint(paths, rules))
    os.chdir(ROOT)
    found = lint([Path(path) for path in rules.paths], rules)
    counted = {path: [item for item in found if item.path.is_relative_to(path)] for path in rules.not_clean}
    for package, items in counted.items():
        print(f"{package}: {len(items)} findings, not clean yet{_most_frequent(items)}")
    waived = {item for items in counted.values() for item in items}
    return _report([item for item in found if item not in waived])


def _most_frequent(items: list[Finding]) -> str:
    counts = Counter("long sentence" if item.rule.startswith("sentence") else item.rule for item in items)
    return "".join(f", {rule} {count}" for rule, count in counts.most_common(3))


def _report(found: list[Finding]) -> int:
    for item in found:
        print(item)
    print(f"prose: {len(found)} findings", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
