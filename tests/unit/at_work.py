"""A workbench process with lasers lit, for the tests that end it: lights, then works as an argument says.

Call: at_work.py PORT WORK, WORK being `beats` (short pieces of Python), `computes` (0.1 s in C code that no
signal interrupts, as long a rest, a beat) or `terminal` (as `beats`, its standard input its terminal).
"""

from __future__ import annotations

import fcntl
import hashlib
import sys
import termios
import time

from workbench.cli.stopping import StopAfterShot
from workbench.devices.serial_lasers import SerialLaserBank


def compute(for_s: float = 0.1) -> None:
    rounds = 100_000
    began = time.perf_counter()
    hashlib.pbkdf2_hmac("sha256", b"", b"", rounds)
    took = time.perf_counter() - began
    hashlib.pbkdf2_hmac("sha256", b"", b"", max(1, round(rounds * (for_s - took) / took)))


def main(port: str, work: str) -> None:
    if work == "terminal":
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    StopAfterShot()  # as `workbench run` does
    bank = SerialLaserBank(port, ("L1", "L2", "L3", "L4"))
    with bank.lit(["L1", "L3"], for_s=60.0):
        print(bank._guardian._process.pid, flush=True)
        while True:
            bank.beat()
            if work == "computes":
                compute()
                time.sleep(0.08)
            time.sleep(0.02)


if __name__ == "__main__":
    main(*sys.argv[1:])
