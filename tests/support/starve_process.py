"""Ends a process and keeps it from its turn to end, for the test of what the guardian then sees.

Call: python -m tests.support.starve_process PID SIGNAL SECONDS. Prints the time of the signal
(ns, CLOCK_MONOTONIC) and whether the process was still there at the end of the seconds. Needs the
right to real-time priority.
"""

from __future__ import annotations

import os
import sys
import time

from tests.firmware.parts import is_there


def main(pid: int, number: int, busy_s: float) -> None:
    here = {min(os.sched_getaffinity(0))}
    for process in (0, pid):
        os.sched_setaffinity(process, here)
    # Before the workbench, after the guardian.
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(5))
    began_ns = time.monotonic_ns()
    os.kill(pid, number)
    while time.monotonic_ns() < began_ns + busy_s * 1e9:
        pass
    print(began_ns, int(is_there(pid)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
