"""`make mutants`: draw mutants of the core, run the tests of their package, list those that survive.

    python -m tests.mutants --mutants 200 --seed 1
    python -m tests.mutants --within workbench/calibration workbench/model/rig.py

Each mutant is one change (`tests.mutants.mutation`) in a copy of the project. It is killed where a test of
`tests/unit/<package>` fails or does not end. The test file of the module's name runs first, then the files
that execute the changed function (`tests.mutants.executed`). All files run where the change is outside
functions, or no file executes the function in its own process.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from tests.mutants.mutation import Mutation, first_line_of_function, mutations
from tests.mutants.project import ROOT, Project, UnitTestFile

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


def selected_runs(mutant: Mutant, files: Sequence[UnitTestFile]) -> list[list[Path]]:
    """Test files that may kill a mutant, in two runs: the module's own, then the others, fast ones first.

    Args:
        mutant: the mutant.
        files: test files of its package.
    """
    function = f"{mutant.module}:{first_line_of_function(mutant.mutation)}"
    executing = [file for file in files if function in file.executed]
    others = sorted(executing or files, key=lambda file: file.time_s)
    own = [file.path for file in files if file.path == mutant.own_test]
    return [paths for paths in (own, [f.path for f in others if f.path not in own]) if paths]


def survives(mutant: Mutant, project: Project, files: Sequence[UnitTestFile], patience: float) -> bool:
    """Whether no test of the mutant's package fails or exceeds its time by the factor `patience`."""
    limit_s = patience * sum(file.time_s for file in files)
    with project.changed(mutant.module, mutant.mutation.source):
        return all(project.passes(tests, limit_s) for tests in selected_runs(mutant, files))


def main() -> int:
    """Run and print; 1 if fewer than 90 % are killed."""
    asked = _arguments()
    mutants = drawn(asked.packages, asked.mutants, asked.seed)
    mutants = [m for m in mutants if any(m.module.is_relative_to(path) for path in asked.within)]
    with tempfile.TemporaryDirectory() as folder:
        projects: SimpleQueue[Project] = SimpleQueue()
        for job in range(asked.jobs):
            projects.put(Project(Path(folder) / str(job)))
        first = projects.get()
        files = {package: first.test_files(package) for package in sorted({m.package for m in mutants})}
        projects.put(first)
        survivors: list[Mutant] = []
        done = 0

        def test(mutant: Mutant) -> None:
            nonlocal done
            project = projects.get()
            try:
                survived = survives(mutant, project, files[mutant.package], SPARE_TIME * asked.jobs)
            finally:
                projects.put(project)
            done += 1
            if survived:
                survivors.append(mutant)
            print(f"{done:4} {'SURVIVED' if survived else 'killed  '} {mutant}", file=sys.stderr, flush=True)

        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(test, mutants))
    killed = 1.0 - len(survivors) / max(len(mutants), 1)
    print(f"{len(mutants)} mutants of {', '.join(asked.packages)}, seed {asked.seed}: {killed:.1%} killed")
    for mutant in sorted(survivors, key=str):
        print(f"survived: {mutant}")
    return 0 if killed >= GOAL else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mutants", type=int, default=200, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--packages", nargs="+", default=CORE, choices=CORE, help="packages to change")
    parser.add_argument(
        "--within", nargs="+", type=Path, default=[Path("workbench")], help="test only those in these folders"
    )
    parser.add_argument("--jobs", type=int, default=2, help="mutants tested at a time")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
