import os

import pytest
from xdist.scheduler import LoadFileScheduling  # type: ignore[import-untyped]

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
"""They run processes of real-time priority: two that compute keep each other from running, as nothing does at
a bench."""


class Schedule(LoadFileScheduling):  # type: ignore[misc]
    """A file's tests run one after the other, and so do all of `REAL_TIME`."""

    def _split_scope(self, nodeid: str) -> str:
        file: str = super()._split_scope(nodeid)
        return "real time" if file in REAL_TIME else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Schedule:
    return Schedule(config, log)
