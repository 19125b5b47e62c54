"""The entry point of the search for spots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.draw import Drawn, draw
from workbench.model.errors import BadInputError
from workbench.spots import SpotFinder, find_spots, is_compiled


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


NOISE = draw([], np.random.default_rng(8))


def test_a_finder_refuses_another_size() -> None:
    with pytest.raises(BadInputError, match="SpotFinder"):
        SpotFinder((10, 10)).find(NOISE)


def test_it_is_known_whether_the_loops_are_compiled(tmp_path: Path) -> None:
    """The technician sees the reason for the wait before the first capture."""
    assert not is_compiled(tmp_path)
    find_spots(draw([Drawn(60, 30)], rng()))
    assert is_compiled()
