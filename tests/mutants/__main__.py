"""`make mutants`: draw mutants of the core, run the tests of their package, list those that survive.

    python -m tests.mutants --mutants 200 --seed 1
    python -m tests.mutants --within workbench/calibration workbench/model/rig.py

Each mutant is one change (`tests.mutants.mutation`) in a copy of the project. It is killed where a test of
`tests/unit/<package>` fails or does not end. First each mutant meets the test file of the module's name. The
survivors then meet the files that execute the changed function (`tests.mutants.executed`), or all files where
the change is outside functions, or no file executes the function in its own process.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
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
"""Factor on the time of the unchanged module's tests after which a mutant counts as killed."""


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


def other_tests(mutant: Mutant, files: Sequence[UnitTestFile]) -> list[UnitTestFile]:
    """Test files that may kill a mutant beside the module's own, fast ones first.

    Args:
        mutant: the mutant.
        files: test files of its package.
    """
    function = f"{mutant.module}:{first_line_of_function(mutant.mutation)}"
    selected = [file for file in files if function in file.executed] or files
    others = [file for file in selected if file.path != mutant.own_test]
    return sorted(others, key=lambda file: file.time_s)


@dataclass(frozen=True)
class Workers:
    """Copies of the project, each for one mutant at a time."""

    projects: SimpleQueue[Project]
    jobs: int

    @classmethod
    def of(cls, jobs: int, folder: Path) -> Workers:
        """Copies in a folder."""
        projects: SimpleQueue[Project] = SimpleQueue()
        for job in range(jobs):
            projects.put(Project(folder / str(job)))
        return cls(projects, jobs)

    def survivors(
        self, mutants: Sequence[Mutant], tests: Callable[[Project, Mutant], Sequence[UnitTestFile]]
    ) -> list[Mutant]:
        """The mutants that `tests` do not kill; progress on standard error."""
        with ThreadPoolExecutor(self.jobs) as pool:
            survived = list(pool.map(lambda mutant: self._survives(mutant, tests), mutants))
        return [mutant for mutant, alive in zip(mutants, survived, strict=True) if alive]

    def _survives(self, mutant: Mutant, tests: Callable[[Project, Mutant], Sequence[UnitTestFile]]) -> bool:
        project = self.projects.get()
        try:
            files = tests(project, mutant)
            limit_s = SPARE_TIME * self.jobs * sum(file.time_s for file in files)
            with project.changed(mutant.module, mutant.mutation.source):
                survived = not files or project.passes([file.path for file in files], limit_s)
        finally:
            self.projects.put(project)
        print(f"{'survives' if survived else 'killed  '} {mutant}", file=sys.stderr, flush=True)
        return survived


def main() -> int:
    """Run and print; 1 if fewer than 90 % are killed."""
    asked = _arguments()
    mutants = drawn(asked.packages, asked.mutants, asked.seed)
    mutants = [m for m in mutants if any(m.module.is_relative_to(path) for path in asked.within)]
    with tempfile.TemporaryDirectory() as folder:
        workers = Workers.of(asked.jobs, Path(folder))
        print("tests of the module's name", file=sys.stderr)
        left = workers.survivors(mutants, lambda project, m: project.test_files(m.own_test))
        print("other tests of the package", file=sys.stderr)
        survivors = workers.survivors(
            left, lambda project, m: other_tests(m, project.test_files(Path("tests/unit") / m.package))
        )
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
