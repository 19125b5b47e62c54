"""A copy of the project in which one module at a time is changed and tested."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAMS = "laser-range-workbench/programs"
"""Folder of traced programs below that of caches."""
KERNELS = Path("workbench/spots/kernels")
"""Modules whose functions numba compiles into functions of other modules."""


@dataclass(frozen=True)
class UnitTestFile:
    """A test file of the unchanged project."""

    path: Path
    """Relative to the project."""
    time_s: float
    executed: frozenset[str]
    """Functions that it executes, as `module:first line`."""


@dataclass
class Project:
    """A copy of the files under version control, with the present content and caches of its own."""

    folder: Path
    caches: Path = field(init=False)
    machine_code: Path = field(init=False)
    """Functions that numba has compiled."""
    records: dict[Path, UnitTestFile] = field(default_factory=dict)

    def __post_init__(self) -> None:
        listed = subprocess.run(
            ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
        )
        for name in filter(None, listed.stdout.split("\0")):
            target = self.folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
        self.caches = self.folder / ".caches"
        self.machine_code = self.caches / "numba"
        self.machine_code.mkdir(parents=True)

    def passes(self, tests: Sequence[Path], timeout_s: float) -> bool:
        """Whether the tests pass in time."""
        try:
            return self._pytest([*map(str, tests)], {}, timeout_s)
        except subprocess.TimeoutExpired:
            return False

    def test_files(self, path: Path) -> list[UnitTestFile]:
        """The test file, or those in a folder; each was run alone in the unchanged project.

        Raises:
            SystemExit: a file fails.
        """
        found = sorted((self.folder / path).rglob("test_*.py")) or [self.folder / path]
        return [self._recorded(file.relative_to(self.folder)) for file in found if file.is_file()]

    @contextmanager
    def changed(self, module: Path, source: str) -> Iterator[None]:
        """The project with another text of one module, which is restored at the end."""
        path = self.folder / module
        unchanged, times = path.read_bytes(), path.stat()
        usual = self.machine_code
        with tempfile.TemporaryDirectory(dir=self.caches) as empty:
            # Numba does not compile again where only the source of a called function has changed.
            self.machine_code = Path(empty) if module.is_relative_to(KERNELS) else usual
            path.write_text(source)
            try:
                yield
            finally:
                path.write_bytes(unchanged)
                os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
                self.machine_code = usual

    def _recorded(self, path: Path) -> UnitTestFile:
        if path not in self.records:
            self.records[path] = self._record(path)
        return self.records[path]

    def _record(self, path: Path) -> UnitTestFile:
        # A program that another file has traced would be loaded, and its functions not executed.
        shutil.rmtree(self.caches / PROGRAMS, ignore_errors=True)
        functions = self.folder / ".executed"
        start = time.monotonic()
        recorded = ["-p", "tests.mutants.executed", str(path)]
        if not self._pytest(recorded, {"EXECUTED": str(functions)}, None):
            raise SystemExit(f"{path} fails without any change: mend it first")
        return UnitTestFile(path, time.monotonic() - start, frozenset(functions.read_text().splitlines()))

    def _pytest(self, arguments: Sequence[str], env: dict[str, str], timeout_s: float | None) -> bool:
        command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "-p", "no:cacheprovider"]
        own = {
            "PYTHONPATH": str(self.folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            "XDG_CACHE_HOME": str(self.caches),
            "NUMBA_CACHE_DIR": str(self.machine_code),
        }
        done = subprocess.run(
            [*command, *arguments],
            cwd=self.folder,
            env=os.environ | own | env,
            capture_output=True,
            timeout=timeout_s,
        )
        return done.returncode == 0
