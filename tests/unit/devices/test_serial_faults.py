"""Random faults of the line and of the controller together: off is never believed that is not so."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from tests.support.lasers import serial_bank
from workbench.emulator.controller import Controller
from workbench.emulator.pty import PtyServer
from workbench.emulator.spec import ControllerSpec
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError

IDS = ("L1", "L2", "L3", "L4")
FAULTS = ("garbage before", "torn", "lost", "late", "too late", "twice", "a bit flipped", "stale")
LINE_FAULTS, STUCK = 0.2, 0.3
"""Chances: of a reply that is spoilt, and of a controller that does not switch off."""


@dataclass
class BadLine:
    """A controller, and a line that spoils some of its replies."""

    rng: np.random.Generator
    controller: Controller = field(default_factory=lambda: Controller(IDS, ControllerSpec()))
    spoils: bool = False
    happened: Counter[str] = field(default_factory=Counter)
    last: bytes = b"OK OFF\n"

    def receive(self, data: bytes) -> bytes:
        reply = self.controller.receive(data)
        if not (self.spoils and reply and self.rng.random() < LINE_FAULTS):
            self.last = reply
            return reply
        fault = str(self.rng.choice(FAULTS))
        self.happened[fault] += 1
        return self._spoilt(fault, reply)

    def _spoilt(self, fault: str, reply: bytes) -> bytes:
        match fault:
            case "garbage before":
                return self.rng.bytes(int(self.rng.integers(1, 30))) + reply
            case "torn":
                return reply[: int(self.rng.integers(1, len(reply)))]
            case "lost":
                return b""
            case "late" | "too late":
                time.sleep(0.1 if fault == "late" else 0.6)
                return reply
            case "twice":
                return reply + reply
            case "stale":
                return self.last
            case _:
                at = int(self.rng.integers(0, len(reply)))
                return reply[:at] + bytes([reply[at] ^ 1 << int(self.rng.integers(0, 8))]) + reply[at + 1 :]


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in (2, 3))])
def test_what_is_said_to_be_off_is_off(seed: int) -> None:
    line = BadLine(np.random.default_rng(seed))
    server = PtyServer(line.receive)
    bank = serial_bank(server.port, IDS)
    outcomes: Counter[str] = Counter()
    for _ in range(12):
        line.spoils = True
        try:
            with bank.lit(["L1", "L4"], for_s=30.0):
                if line.rng.random() < STUCK:
                    line.controller.fault = "ignores_off"
        except (RigNotReadyError, LaserOffNotConfirmedError) as error:
            outcomes[type(error).__name__] += 1
        else:
            outcomes["off"] += 1
            assert line.controller.lit() == ()
        line.spoils, line.controller.fault = False, "none"
        bank.all_off()
        assert line.controller.lit() == ()
    bank.close()
    server.close()
    print(dict(outcomes), dict(line.happened))
    assert outcomes["off"]
    assert outcomes["LaserOffNotConfirmedError"]


def test_the_faults_are_all_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """The suite before is only as good as what it injects."""
    happened: Counter[str] = Counter()
    for seed in range(4):
        line = BadLine(np.random.default_rng(seed), spoils=True)
        monkeypatch.setattr(line, "_spoilt", lambda fault, reply: reply)
        for _ in range(200):
            line.receive(b"STATE? 1\n")
        happened += line.happened
    assert set(happened) == set(FAULTS)
