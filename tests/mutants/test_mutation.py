"""Mutants of a small module, and their end by a test."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.mutants.__main__ import CORE, drawn, other_tests
from tests.mutants.mutation import first_line_of_function, mutations
from tests.mutants.project import UnitTestFile

SOURCE = '''"""Docstring 1."""
LIMIT: int = 3

def bounded(x: float, most: float = 2.5) -> float:
    """Docstring 2."""
    if not x < most and x > 0:
        raise ValueError(f"{x + 1}" + "b")
    return x * most
'''


def test_each_change_is_a_valid_module_with_one_difference() -> None:
    found = [(m.before, m.after) for m in mutations(SOURCE)]
    assert ("3", "4") in found
    assert ("2.5", "5.0") in found
    assert ("x < most", "x >= most") in found
    assert ("not x < most and x > 0", "not x < most or x > 0") in found
    assert ("not x < most", "x < most") in found
    assert ("x * most", "x / most") in found
    assert any(after == "pass" for _, after in found)
    plain = ast.unparse(ast.parse(SOURCE)).splitlines()
    for mutation in mutations(SOURCE):
        changed = mutation.source.splitlines()
        assert sum(a != b for a, b in zip(plain, changed, strict=True)) == 1, mutation


def test_texts_and_annotations_stay() -> None:
    expressions = [m.before for m in mutations(SOURCE) if not m.before.startswith(("raise", "not"))]
    assert expressions
    assert not any(text in line for line in expressions for text in ("Docstring", "x + 1", "float"))


def test_the_draw_depends_on_its_seed_alone() -> None:
    first, second, other = (drawn(["model"], 5, seed) for seed in (1, 1, 2))
    assert list(map(str, first)) == list(map(str, second)) != list(map(str, other))
    assert all(m.module.parts[:2] == ("workbench", "model") for m in first)


def test_every_package_of_the_core_has_tests_of_its_own() -> None:
    root = Path(__file__).parents[2]
    assert all((root / "tests/unit" / package).is_dir() for package in CORE)


def test_a_change_inside_a_function_is_tested_by_the_files_that_execute_it() -> None:
    mutant = next(m for m in drawn(["model"], 40, 1) if first_line_of_function(m.mutation) is not None)
    function = f"{mutant.module}:{first_line_of_function(mutant.mutation)}"
    slow, fast = (UnitTestFile(Path(f"{t}.py"), t, t, frozenset({function})) for t in (2.0, 1.0))
    other = UnitTestFile(Path("other.py"), 0.1, 0.1, frozenset())
    own = UnitTestFile(mutant.own_test, 9.0, 9.0, frozenset())
    assert other_tests(mutant, [slow, other, own, fast]) == [fast, slow]
    assert other_tests(mutant, [other, own]) == [other]


def test_the_function_of_a_change_begins_at_its_first_decorator() -> None:
    source = "A = 1\n\n@cache\ndef f(x):\n    def g():\n        return x + 2\n    return g() + 3\n"
    lines = {m.before: first_line_of_function(m) for m in mutations(source)}
    assert lines == {"1": None, "x + 2": 5, "2": 5, "g() + 3": 3, "3": 3}
