"""`make mutants`: draw mutants of the core, run the tests of their package, list those that survive.

    python -m tests.mutants --mutants 200 --seed 1
    python -m tests.mutants --packages ranging model --mutants 20

Each mutant is one change (`tests.mutants.mutation`) in a copy of the project. It is killed where a test of
`tests/unit/<package>` fails or does not end. The test file of the module's name runs first.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from tests.mutants.mutation import Mutation, mutations

ROOT = Path(__file__).parents[2]
CORE = ("ranging", "calibration", "session", "devices", "spots", "model")
GOAL = 0.9
"""Least share of mutants that the tests kill."""
SPARE_TIME = 3.0
"""Factor on the time of the unchanged package's tests after which a mutant counts as killed."""


@dataclass(frozen=True)
class Mutant:
    """A change of one module."""

    module: Path
    """Relative to the project."""
    mutation: Mutation

    @property
    def package(self) -> str:
        """Name of the package below `workbench`."""
        return self.module.parts[1]

    @property
    def own_test(self) -> Path:
        """Test file of the module's name, relative to the project."""
        inside = self.module.relative_to("workbench")
        return Path("tests/unit") / inside.parent / f"test_{inside.name}"

    def __str__(self) -> str:
        change = self.mutation
        return f"{self.module}:{change.line}: {change.before}  ->  {change.after}"


def drawn(packages: Sequence[str], count: int, seed: int) -> list[Mutant]:
    """Mutants of the packages, every change equally likely."""
    modules = sorted(p for name in packages for p in (ROOT / "workbench" / name).rglob("*.py"))
    every = [Mutant(p.relative_to(ROOT), m) for p in modules for m in mutations(p.read_text())]
    chosen = np.random.default_rng(seed).choice(len(every), min(count, len(every)), replace=False)
    return [every[n] for n in chosen]


def copy_of_project(folder: Path) -> Path:
    """A copy of the files under version control, with the present content."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True)
    for name in filter(None, listed.stdout.split("\0")):
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, target)
    return folder


def tests_pass(project: Path, tests: Sequence[Path], timeout_s: float | None) -> bool:
    """Whether the tests pass in time in a copy of the project."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "-p", "no:cacheprovider"]
    env = os.environ | {"PYTHONPATH": str(project), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            [*command, *map(str, tests)], cwd=project, env=env, capture_output=True, timeout=timeout_s
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def survives(mutant: Mutant, project: Path, timeout_s: float) -> bool:
    """Whether no test of the mutant's package fails."""
    path = project / mutant.module
    original = path.read_text()
    path.write_text(mutant.mutation.source)
    try:
        whole = Path("tests/unit") / mutant.package
        first = [mutant.own_test] if (project / mutant.own_test).is_file() else []
        return all(tests_pass(project, [tests], timeout_s) for tests in (*first, whole))
    finally:
        path.write_text(original)


def main() -> int:
    """Run and print; 1 if fewer than 90 % are killed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mutants", type=int, default=200, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--packages", nargs="+", default=CORE, choices=CORE, help="packages to change")
    parser.add_argument("--jobs", type=int, default=2, help="mutants tested at a time")
    asked = parser.parse_args()
    mutants = drawn(asked.packages, asked.mutants, asked.seed)
    with tempfile.TemporaryDirectory() as folder:
        projects: SimpleQueue[Path] = SimpleQueue()
        for job in range(asked.jobs):
            projects.put(copy_of_project(Path(folder) / str(job)))
        limit_s = {package: _time_of_tests(package, projects) for package in {m.package for m in mutants}}
        survivors: list[Mutant] = []
        done = 0

        def test(mutant: Mutant) -> None:
            nonlocal done
            project = projects.get()
            try:
                survived = survives(mutant, project, SPARE_TIME * asked.jobs * limit_s[mutant.package])
            finally:
                projects.put(project)
            done += 1
            if survived:
                survivors.append(mutant)
            print(f"{done:4} {'SURVIVED' if survived else 'killed  '} {mutant}", file=sys.stderr, flush=True)

        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(test, mutants))
    killed = 1.0 - len(survivors) / len(mutants)
    print(f"{len(mutants)} mutants of {', '.join(asked.packages)}, seed {asked.seed}: {killed:.1%} killed")
    for mutant in sorted(survivors, key=str):
        print(f"survived: {mutant}")
    return 0 if killed >= GOAL else 1


def _time_of_tests(package: str, projects: SimpleQueue[Path]) -> float:
    """Duration of the unchanged package's tests, s.

    Raises:
        SystemExit: they fail.
    """
    project = projects.get()
    start = time.monotonic()
    passed = tests_pass(project, [Path("tests/unit") / package], None)
    projects.put(project)
    if not passed:
        raise SystemExit(f"tests/unit/{package} fails without any change: mend it first")
    return time.monotonic() - start


if __name__ == "__main__":
    sys.exit(main())
