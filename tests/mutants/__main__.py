"""`make mutants`: draw mutants of the core, run the tests of their package, list those that survive.

    python -m tests.mutants --mutants 200 --seed 1
    python -m tests.mutants --within workbench/calibration workbench/model/rig.py

Each mutant is one change (`tests.mutants.mutation`) in a copy of the project. It is killed where a test of
`tests/unit/<package>` fails or does not end. First it meets the test file of the module's name; then,
where it survives, the files that execute the changed function (`tests.mutants.executed`). Where the change is
outside functions, or no file executes the function in its own process, it meets those that import the module.

The tests run in forked processes of one server per job (`tests.mutants.server`), which has imported the large
libraries; the machine code of numba's functions is kept by content (`tests.mutants.machine_code`).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import TypeVar

import numpy as np

from tests.mutants.mutation import Mutation, first_line_of_function, mutations
from tests.mutants.project import ROOT, Project, UnitTestFile

CORE = ("ranging", "calibration", "session", "devices", "spots", "model")
GOAL = 0.9
"""Least share of mutants that the tests kill."""
S = TypeVar("S")
T = TypeVar("T")


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

    @property
    def package_tests(self) -> Path:
        """Folder of the package's tests, relative to the project."""
        return Path("tests/unit") / self.package

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
    line = first_line_of_function(mutant.mutation)
    # Numba's functions are not recorded: a file that imports their module may execute them.
    selected = files
    for function in (f"{mutant.module}:1", f"{mutant.module}:{line}"):
        selected = [file for file in selected if function in file.executed] or selected
    others = [file for file in selected if file.path != mutant.own_test]
    return sorted(others, key=lambda file: file.cpu_s)


def test_files(path: Path) -> list[Path]:
    """The test file, or those in a folder; relative to the project, as `path`."""
    found = sorted((ROOT / path).rglob("test_*.py")) or [ROOT / path]
    return [file.relative_to(ROOT) for file in found if file.is_file()]


@dataclass
class Workers:
    """Copies of the project, each for one test run at a time, and what is known of the unchanged tests."""

    projects: Sequence[Project]
    records: dict[Path, UnitTestFile | None] = field(default_factory=dict)
    """None where a file fails without any change: it kills no mutant."""

    @classmethod
    @contextmanager
    def of(cls, jobs: int) -> Iterator[Workers]:
        """Copies in a temporary folder."""
        with tempfile.TemporaryDirectory() as folder:
            machine_code = Path(folder) / "numba"
            workers = cls([Project(Path(folder) / str(job), machine_code) for job in range(jobs)])
            try:
                yield workers
            finally:
                for project in workers.projects:
                    project.close()

    def survivors(
        self, mutants: Sequence[Mutant], tests: Callable[[Mutant], Sequence[UnitTestFile]]
    ) -> list[Mutant]:
        """The mutants that `tests` do not kill."""

        def survives(project: Project, mutant: Mutant) -> tuple[bool, str]:
            files = tests(mutant)
            with project.changed(mutant.module, mutant.mutation.source):
                passes = project.passes(files, len(self.projects)) if files else True
            word = {True: "survives", False: "killed", None: "no end"}[passes]
            return bool(passes), f"{word:8} {mutant}"

        survived = self._map(survives, mutants)
        return [mutant for mutant, alive in zip(mutants, survived, strict=True) if alive]

    def record(self, paths: Iterable[Path]) -> None:
        """Run those test files in the unchanged project that have not been run yet."""

        def recorded(project: Project, path: Path) -> tuple[UnitTestFile | None, str]:
            file = project.record(path)
            return file, f"{file.cpu_s:5.1f} s {path}" if file else f"{path} fails, left out: mend it first"

        new = sorted(set(paths) - set(self.records))
        self.records |= zip(new, self._map(recorded, new), strict=True)

    def files(self, path: Path) -> list[UnitTestFile]:
        """Records of a test file, or of those in a folder, without those that fail."""
        return [record for file in test_files(path) if (record := self.records[file])]

    def _map(self, work: Callable[[Project, S], tuple[T, str]], items: Sequence[S]) -> list[T]:
        """Results of `work`; its lines and the time left on standard error."""
        free: SimpleQueue[Project] = SimpleQueue()
        for project in self.projects:
            free.put(project)
        start = time.monotonic()
        done = count(1)

        def one(item: S) -> T:
            project = free.get()
            try:
                result, line = work(project, item)
            finally:
                free.put(project)
            number = next(done)
            left_s = (time.monotonic() - start) / number * (len(items) - number)
            print(
                f"{number:3}/{len(items)}, {left_s / 60:3.0f} min left: {line}", file=sys.stderr, flush=True
            )
            return result

        with ThreadPoolExecutor(len(self.projects)) as pool:
            return list(pool.map(one, items))


def surviving(mutants: Sequence[Mutant], jobs: int) -> list[Mutant]:
    """The mutants that no test kills; progress on standard error."""
    with Workers.of(jobs) as workers:
        print("unchanged tests of the modules' names", file=sys.stderr)
        workers.record(file for m in mutants for file in test_files(m.own_test))
        print("mutants", file=sys.stderr)
        left = workers.survivors(mutants, lambda m: workers.files(m.own_test))
        print("unchanged other tests", file=sys.stderr)
        workers.record(file for m in left for file in test_files(m.package_tests))
        print("mutants that survived", file=sys.stderr)
        return workers.survivors(left, lambda m: other_tests(m, workers.files(m.package_tests)))


def main() -> int:
    """Run and print; 1 if fewer than 90 % are killed."""
    asked = _arguments()
    mutants = drawn(asked.packages, asked.mutants, asked.seed)
    mutants = [m for m in mutants if any(m.module.is_relative_to(path) for path in asked.within)]
    survivors = surviving(mutants, asked.jobs)
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
