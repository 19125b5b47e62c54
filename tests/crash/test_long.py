"""The long session with random faults, at a size that the tests can afford; `make crash` runs it whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.long import compare


@pytest.mark.parametrize("seed", [2])
def test_a_session_with_random_faults_loses_nothing(tmp_path: Path, seed: int) -> None:
    told = compare(100, tmp_path, seed, mean_records=150)
    assert any("kill" in line or "stop" in line or "disk full" in line for line in told), told
