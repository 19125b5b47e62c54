"""Failures in words."""

from __future__ import annotations

import numpy as np

from tests.support.draw import Drawn, draw
from workbench.spots import Failure, Scanline, explain, find_spots

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_every_failure_is_explained_with_cause_and_remedy() -> None:
    for failure in Failure:
        words = explain(failure)
        assert "Cause: " in words
        assert "Do: " in words


def test_a_reflection_on_the_scanline_is_reported_and_explained_as_too_many_spots() -> None:
    lasers, reflection = [Drawn(30, 30), Drawn(60, 30)], Drawn(90, 29.5, 8e3, 1.6, 1.6)
    finding = find_spots(draw([*lasers, reflection], rng(8)), scanlines=ROW, expected=2)
    assert finding.failures == (Failure.TOO_MANY,)
    assert len(finding.spots) == 3
    assert "reflection on the scanline" in explain(Failure.TOO_MANY)
