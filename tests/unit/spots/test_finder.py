"""The entry point of the search for spots."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from tests.support.draw import draw
from workbench.model.errors import BadInputError
from workbench.spots import SpotFinder, is_compiled

NOISE = draw([], np.random.default_rng(8))
LOOP = """
from workbench.spots.kernels.compiled import compiled

@compiled
def plus_one(x):
    return x + 1.0
"""


def test_a_finder_refuses_another_size() -> None:
    with pytest.raises(BadInputError, match="SpotFinder"):
        SpotFinder((10, 10)).find(NOISE)


def test_it_is_known_whether_the_loops_are_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The technician sees the reason for the wait before the first capture."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", "")
    monkeypatch.setattr("numba.core.config.CACHE_LOCATOR_CLASSES", "")
    assert not is_compiled(tmp_path)
    loop = tmp_path / "loop.py"
    loop.write_text(LOOP)
    assert runpy.run_path(str(loop))["plus_one"](1.0) == 2.0
    assert is_compiled(tmp_path)
