import os

import pytest

# As the command line does. Two workers with two threads each on two cores spend most of their time waiting.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

REAL_TIME = {
    "tests/bench/test_example_laser_driver.py",
    "tests/bench/test_unplugged.py",
    "tests/firmware/test_pins.py",
    "tests/unit/devices/test_digital_output.py",
    "tests/unit/devices/test_guarded_line.py",
    "tests/unit/devices/test_guardian.py",
    "tests/unit/devices/test_real_bench.py",
}
"""They run processes of real-time priority and measure milliseconds. `make test` runs them alone: another
worker that computes keeps their processes from running, as nothing does at a bench."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of these files, so that they can be chosen and left out."""
    for item in items:
        if item.nodeid.partition("::")[0] in REAL_TIME:
            item.add_marker("real_time")
        if item.nodeid.startswith("tests/wheel/"):
            item.add_marker("wheel")
