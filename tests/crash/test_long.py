"""The long session with random faults, at a size that the tests can afford; `make crash` runs it whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.long import KEPT_B, compare, growth


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [2])
def test_a_session_with_random_faults_loses_nothing(tmp_path: Path, seed: int) -> None:
    told = compare(100, tmp_path, seed, mean_records=150)
    assert any("kill" in line or "stop" in line or "disk full" in line for line in told), told


def test_a_shot_leaves_no_more_in_memory_than_the_fit_needs(tmp_path: Path) -> None:
    left = growth(200, tmp_path)
    most = sorted(left.items(), key=lambda each: -each[1])[:5]
    assert 1000 < sum(left.values()) <= KEPT_B, most
