"""Tests stand where their modules do."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.conftest import REAL_TIME, SLOW

ROOT = Path(__file__).parents[2]
LEAST_SHARE = 0.9


def test_nine_modules_of_ten_have_a_test_file_of_their_name() -> None:
    modules = [path for path in (ROOT / "workbench").rglob("*.py") if path.name != "__init__.py"]
    without = [path for path in modules if not _test_of(path).is_file()]
    assert len(without) <= (1 - LEAST_SHARE) * len(modules), sorted(map(str, without))


def test_every_test_file_of_a_module_tests_something() -> None:
    for path in (ROOT / "tests/unit").rglob("test_*.py"):
        functions = [
            node.name for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)
        ]
        assert any(name.startswith("test_") for name in functions), path


@pytest.mark.parametrize("file", sorted(REAL_TIME | SLOW))
def test_files_with_a_marker_exist(file: str) -> None:
    assert (ROOT / file).is_file()


def _test_of(module: Path) -> Path:
    inside = module.relative_to(ROOT / "workbench")
    return ROOT / "tests/unit" / inside.parent / f"test_{inside.name}"
