"""A copy of the project in which one module at a time is changed and tested."""

from __future__ import annotations

import compileall
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from py_compile import PycInvalidationMode
from typing import Any

ROOT = Path(__file__).parents[2]
IMPORTED = ("-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning")
"""The server has imported plugins of pytest; their asserts are not rewritten."""
PROGRAMS = "laser-range-workbench/programs"
"""Folder of traced programs below that of caches."""
SPARE_TIME = 3.0
"""Factor on the time of the unchanged project's tests after which a mutant counts as killed."""
MARGIN_S = 60.0
"""Added to that time: compilation, a busy computer."""


@dataclass(frozen=True)
class UnitTestFile:
    """A test file of the unchanged project."""

    path: Path
    """Relative to the project."""
    wall_s: float
    cpu_s: float
    executed: frozenset[str]
    """Functions that it executes, as `module:first line`; a module's own code has line 1."""


@dataclass
class Project:
    """A copy of the files that version control does not ignore, and a server of its tests."""

    folder: Path
    machine_code: Path
    """Folder of functions that numba has compiled; copies may share it (`tests.mutants.machine_code`)."""
    server: subprocess.Popen[str] = field(init=False)

    def __post_init__(self) -> None:
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        for name in filter(None, listed.stdout.split("\0")):
            target = self.folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
        # By content: two mutants may have the same size and the same second.
        compileall.compile_dir(self.folder, quiet=1, invalidation_mode=PycInvalidationMode.CHECKED_HASH)
        self.server = self._started()

    def passes(self, tests: Sequence[UnitTestFile], jobs: int) -> bool | None:
        """Whether the tests pass; None where they do not end in time.

        Args:
            tests: test files.
            jobs: number of projects that are tested at the same time.
        """
        wall_s, cpu_s = (sum(getattr(file, name) for file in tests) for name in ("wall_s", "cpu_s"))
        limit_s, cpu_limit_s = SPARE_TIME * jobs * wall_s + MARGIN_S, SPARE_TIME * cpu_s + MARGIN_S
        code = self._pytest([str(file.path) for file in tests], {}, limit_s, cpu_limit_s)["code"]
        return None if code is None else code == 0

    def record(self, path: Path) -> UnitTestFile | None:
        """Run a test file alone in the unchanged project; None where it fails."""
        # A program that another file has traced would be loaded, and its functions not executed.
        shutil.rmtree(self._caches / PROGRAMS, ignore_errors=True)
        functions = self.folder / ".executed"
        arguments = ["-p", "tests.mutants.executed", str(path)]
        done = self._pytest(arguments, {"EXECUTED": str(functions)}, 1e4, 1e4)
        if done["code"] != 0:
            return None
        executed = frozenset(functions.read_text().splitlines())
        return UnitTestFile(path, done["wall_s"], done["cpu_s"], executed)

    @contextmanager
    def changed(self, module: Path, source: str) -> Iterator[None]:
        """The project with another text of one module, which is restored at the end."""
        path = self.folder / module
        unchanged = path.read_bytes()
        path.write_text(source)
        try:
            yield
        finally:
            path.write_bytes(unchanged)

    def close(self) -> None:
        """End the server."""
        self.server.communicate()

    @property
    def _caches(self) -> Path:
        return self.folder / ".caches"

    def _started(self) -> subprocess.Popen[str]:
        own = {
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": str(self.folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            "XDG_CACHE_HOME": str(self._caches),
            "NUMBA_CACHE_DIR": str(self.machine_code),
            "NUMBA_CACHE_LOCATOR_CLASSES": "tests.mutants.machine_code.ByContent",
        }
        return subprocess.Popen(
            [sys.executable, "-m", "tests.mutants.server"],
            cwd=self.folder,
            env=os.environ | own,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def _pytest(
        self, arguments: Sequence[str], environment: dict[str, str], limit_s: float, cpu_limit_s: float
    ) -> dict[str, Any]:
        """Run pytest, with the same random examples each time and without a limit to the time of one."""
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        usual = ["-n", "0", "-x", "-q", "-p", "no:cacheprovider", "--hypothesis-profile=ci", *IMPORTED]
        request = {
            "arguments": [*usual, f"--basetemp={self.folder / '.temporary'}", *arguments],
            "environment": environment,
            "limit_s": limit_s,
            "cpu_limit_s": cpu_limit_s,
        }
        self.server.stdin.write(json.dumps(request) + "\n")
        self.server.stdin.flush()
        answer: dict[str, Any] = json.loads(self.server.stdout.readline())
        return answer
