"""Stored programs: the same numbers from memory, from the disk and without a disk."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from workbench.calibration import programs
from workbench.calibration.programs import cache_folder, stored


def solve(matrix: Array, right: Array, power: int) -> tuple[Array, Array]:
    """LAPACK's QR and Cholesky, and a constant."""
    q, r = jnp.linalg.qr(matrix)
    factor = jnp.linalg.cholesky(matrix @ matrix.T + jnp.eye(len(matrix)))
    return q @ (r @ right), factor**power


MATRIX = np.random.default_rng(1).normal(size=(5, 5))
RIGHT = np.arange(5.0)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = cache_folder()
    assert found is not None
    return found


def test_from_the_disk_come_the_same_bits(folder: Path) -> None:
    compiled = stored(2)(solve)(MATRIX, RIGHT, 3)
    assert len(list(folder.glob("*.bin"))) == 1
    loaded = stored(2)(solve)(MATRIX, RIGHT, 3)
    for one, other, plain in zip(
        compiled, loaded, solve(jnp.array(MATRIX), jnp.array(RIGHT), 3), strict=True
    ):
        np.testing.assert_array_equal(one, other)
        np.testing.assert_allclose(one, plain, rtol=1e-12, atol=1e-14)


def test_a_fresh_process_loads_lapack_before_it_calls_it(folder: Path) -> None:
    script = (
        "import numpy as np; from tests.unit.test_programs import solve, stored, MATRIX, RIGHT;"
        "q, _ = stored(2)(solve)(MATRIX, RIGHT, 3); assert np.allclose(q, MATRIX @ RIGHT)"
    )
    for _ in range(2):
        subprocess.run([sys.executable, "-c", script], check=True, cwd=Path(__file__).parents[2])
        assert len(list(folder.glob("*.bin"))) == 1


def test_constants_and_shapes_have_programs_of_their_own(folder: Path) -> None:
    program = stored(2)(solve)
    np.testing.assert_allclose(program(MATRIX, RIGHT, 1)[1] ** 2, program(MATRIX, RIGHT, 2)[1], rtol=1e-12)
    program(MATRIX[:3, :3], RIGHT[:3], 2)
    assert len(list(folder.glob("*.bin"))) == 3


@pytest.mark.parametrize("content", [b"", b"x" * 100], ids=["empty", "garbage"])
def test_a_broken_file_is_made_anew(folder: Path, content: bytes) -> None:
    expected = stored(2)(solve)(MATRIX, RIGHT, 3)
    (path,) = folder.glob("*.bin")
    whole = path.read_bytes()
    path.write_bytes(content or whole[:-1])
    np.testing.assert_array_equal(stored(2)(solve)(MATRIX, RIGHT, 3)[0], expected[0])
    assert len(path.read_bytes()) > len(content)


def test_without_a_folder_it_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert cache_folder() is None
    np.testing.assert_allclose(stored(2)(solve)(MATRIX, RIGHT, 3)[0], MATRIX @ RIGHT, rtol=1e-12)


def test_a_folder_that_others_may_write_is_not_trusted(folder: Path) -> None:
    folder.chmod(0o777)
    assert cache_folder() is None


def test_a_relative_cache_home_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home/.cache/laser-range-workbench/programs"


def test_the_oldest_programs_go(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "KEPT_PROGRAMS", 2)
    program = stored(2)(solve)
    for power in range(4):
        program(MATRIX, RIGHT, power)
    assert len(list(folder.glob("*.bin"))) == 2


def test_it_may_be_traced(folder: Path) -> None:
    program = stored(2)(solve)
    slope = jax.jacfwd(lambda right: program(jnp.array(MATRIX), right, 1)[0])(jnp.array(RIGHT))
    np.testing.assert_allclose(slope, MATRIX, atol=1e-12)
