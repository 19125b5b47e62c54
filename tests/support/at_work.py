"""A workbench process with lasers lit, for the tests that end it: lights, then works as an argument says.

Call: python -m tests.support.at_work PORT WORK, WORK being `beats` (short pieces of Python), `computes`
(0.1 s in C code that no signal interrupts, as long a rest, a beat), `terminal` (as `beats`, its standard
input its terminal) or `loaded` (as `beats`, with the libraries of a session in memory, which take time to be
given back).
"""

from __future__ import annotations

import fcntl
import hashlib
import importlib
import sys
import termios
import time

import numpy as np

from tests.support.lasers import serial_bank
from workbench.cli.stopping import StopAfterCapture
from workbench.model.arrays import FloatArray


def compute(for_s: float = 0.1) -> None:
    rounds = 100_000
    began = time.perf_counter()
    hashlib.pbkdf2_hmac("sha256", b"", b"", rounds)
    took = time.perf_counter() - began
    hashlib.pbkdf2_hmac("sha256", b"", b"", max(1, round(rounds * (for_s - took) / took)))


def load() -> FloatArray:
    """What a session has in memory: the solver, the recording, frames."""
    importlib.import_module("workbench.procedure.engine.run")
    importlib.import_module("workbench.viewer.recording")
    numpy = importlib.import_module("jax.numpy")
    numpy.linalg.svd(numpy.ones((50, 50))).S.block_until_ready()
    return np.ones(6_000_000)


def main(port: str, work: str) -> None:
    held = load() if work == "loaded" else None
    if work == "terminal":
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    StopAfterCapture()  # as `workbench run` does
    bank = serial_bank(port, ("L1", "L2", "L3", "L4"))
    with bank.lit(["L1", "L3"], for_s=60.0):
        print(bank._guardian._process.pid, flush=True)
        assert held is None or held.size
        while True:
            bank.beat()
            if work == "computes":
                compute()
                time.sleep(0.08)
            time.sleep(0.02)


if __name__ == "__main__":
    main(*sys.argv[1:])
