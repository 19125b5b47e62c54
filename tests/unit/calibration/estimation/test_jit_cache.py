import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from workbench.calibration.estimation import jit_cache
from workbench.calibration.estimation.jit_cache import jit_cached

REFIT = """
import json, sys
from tests.support.rigs import World, thesis_rig
from workbench.calibration.estimation.fit import fit
fitted = fit(thesis_rig(), World(thesis_rig(), 5).observations())
print(json.dumps([fitted.values.tolist(), fitted.sd.tolist(), "optimistix" in sys.modules]))
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(jit_cache, "CACHE", tmp_path)
    return tmp_path / "programs"


def scaled(x: Array, y: Array, power: int) -> tuple[Array, Array]:
    return jnp.sin(x) ** power, y @ y


X, Y = np.linspace(0.0, 1.0, 5), np.arange(3.0)


def test_the_result_is_that_of_the_function(folder: Path) -> None:
    first, second = jit_cached(static=1)(scaled)(X, Y, 2)
    np.testing.assert_allclose(first, np.sin(X) ** 2, rtol=1e-14)
    assert second == 5.0
    assert len(list(folder.iterdir())) == 1


def test_a_kept_program_is_not_traced_again(folder: Path) -> None:
    traced = []

    def square(x: Array) -> Array:
        traced.append(x.shape)
        return x * x

    for _ in range(2):
        np.testing.assert_array_equal(jit_cached()(square)(X), X * X)
    assert traced == [(5,)]
    jit_cached()(square)(Y)
    assert traced == [(5,), (3,)]


def test_other_statics_and_dtypes_are_other_programs(folder: Path) -> None:
    program = jit_cached(static=1)(scaled)
    np.testing.assert_allclose(program(X, Y, 1)[0], np.sin(X))
    np.testing.assert_allclose(program(X, Y, 3)[0], np.sin(X) ** 3)
    assert program(X.astype(np.float32), Y, 3)[0].dtype == jnp.float32
    assert len(list(folder.iterdir())) == 3


@pytest.mark.parametrize("damage", [slice(0, 0), slice(40), slice(-1), slice(1, None)])
def test_a_damaged_file_is_made_again(folder: Path, damage: slice) -> None:
    jit_cached(static=1)(scaled)(X, Y, 2)
    (file,) = folder.iterdir()
    file.write_bytes(file.read_bytes()[damage])
    assert jit_cached(static=1)(scaled)(X, Y, 2)[1] == 5.0
    guard, content = file.read_bytes()[:32], file.read_bytes()[32:]
    assert guard == hashlib.sha256(content).digest()


def test_without_a_place_to_keep_it_it_runs_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(jit_cache, "CACHE", tmp_path / "file")
    assert jit_cached(static=1)(scaled)(X, Y, 2)[1] == 5.0


def test_inside_another_program_it_is_a_part_of_it(folder: Path) -> None:
    program = jit_cached()(lambda x: jnp.sin(x).sum())
    np.testing.assert_allclose(jax.grad(program)(X), np.cos(X), rtol=1e-14)
    assert not folder.exists()


def test_a_second_fit_is_the_same_and_needs_no_tracer(tmp_path: Path) -> None:
    """The point of it all: optimistix is not even imported."""
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    runs = [
        json.loads(
            subprocess.run(
                [sys.executable, "-c", REFIT],
                check=True,
                capture_output=True,
                text=True,
                env=environment,
                cwd=Path(__file__).parents[4],
            ).stdout
        )
        for _ in range(2)
    ]
    assert [run[2] for run in runs] == [True, False]
    assert runs[0][:2] == runs[1][:2]
