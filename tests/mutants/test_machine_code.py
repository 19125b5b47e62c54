"""Under what a function's machine code is stored."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.mutants.machine_code import digest

MODULES = {
    "caller.py": "from workbench.inner.callee import f\n",
    "inner/callee.py": "import math\nfrom workbench.inner import constants\n",
    "inner/constants.py": "A = 1\n",
    "other.py": "B = 1\n",
}


def digest_of_caller(folder: Path, changed: str | None = None) -> str:
    for name, text in MODULES.items():
        path = folder / "workbench" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "C = 1\n" * (name == changed))
    digest.cache_clear()
    return digest(folder / "workbench/caller.py")


@pytest.mark.parametrize(
    ("changed", "compiled_again"),
    [("caller.py", True), ("inner/callee.py", True), ("inner/constants.py", True), ("other.py", False)],
)
def test_what_is_imported_is_compiled_in(tmp_path: Path, changed: str, compiled_again: bool) -> None:
    before = digest_of_caller(tmp_path)
    assert (digest_of_caller(tmp_path, changed) != before) == compiled_again


def test_copies_of_a_project_share_machine_code(tmp_path: Path) -> None:
    assert digest_of_caller(tmp_path / "a") == digest_of_caller(tmp_path / "b")
