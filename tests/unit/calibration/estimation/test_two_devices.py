"""The batch fit on two devices of this computer, in a process with XLA's flag."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.calibration.estimation.test_batch import SOLVED_SD

ROOT = Path(__file__).parents[4]


@pytest.mark.thorough
def test_two_devices_give_the_calibrations_of_one() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.two_devices"],
        cwd=ROOT,
        env=os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    assert found["used"] == [[0], [0], [1]]
    assert set(found["equal"].values()) == {True}
    assert found["sharded"]["devices"] == 2
    assert found["sharded"]["difference_sd"] < SOLVED_SD
