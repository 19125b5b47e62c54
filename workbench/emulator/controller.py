"""Emulated firmware of the laser controller: the line protocol of docs/laser-controller.md."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from workbench.emulator.spec import ControllerSpec, Fault

LONGEST_LEASE_MS = 60_000
LONGEST_LINE = 64
IDENTITY = "laser-range-workbench,emulated laser controller,emulated-1,1"


class Refusal(Exception):  # noqa: N818 - an answer, not a failure
    """Refusal of a request, answered with ERR."""


class Controller:
    """Controller with lease and mask of the lasers, off at start. Thread-safe."""

    def __init__(
        self, ids: Sequence[str], spec: ControllerSpec, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._ids = tuple(ids)
        self._clock = clock
        self._lock = threading.Lock()
        self._mask = 0
        self._ends = 0.0
        self._line = bytearray()
        self.fault: Fault = spec.fault
        """Present fault; tests may set it while the controller runs."""
        self.interlock_closed = spec.interlock_closed

    def lit(self) -> tuple[str, ...]:
        """Ids of the lasers that truly emit, independent of what the controller reports."""
        with self._lock:
            mask = self._shining()
        return tuple(name for bit, name in enumerate(self._ids) if mask >> bit & 1)

    def receive(self, data: bytes) -> bytes:
        """Answer to bytes from the line; incomplete lines are kept."""
        answers = bytearray()
        for byte in data:
            if byte == ord("!"):
                self._line.clear()
                answers += self._answer("OFF")
            elif byte == ord("\n"):
                line = self._line.decode("ascii", errors="replace").strip("\r ")
                self._line.clear()
                answers += self._answer(line) if line else b""
            elif len(self._line) <= LONGEST_LINE:
                self._line.append(byte)
        return bytes(answers)

    def _answer(self, line: str) -> bytes:
        try:
            with self._lock:
                reply = f"OK {self._obey(line)}"
        except Refusal as refusal:
            reply = f"ERR {refusal}"
        if self.fault == "silent":
            return b""
        if self.fault == "garbles":
            return b"\xff\xfe" + reply[::-1].encode() + b"\n"
        if self.fault == "stutters":
            return reply[:3].encode()
        return reply.encode() + b"\n"

    def _obey(self, line: str) -> str:
        """Reply after OK. It repeats the verb, so that a late reply is not taken for another."""
        if len(line) > LONGEST_LINE:
            raise Refusal("4 line too long")
        verb, *words = line.split(" ")
        if verb == "*IDN?" and not words:
            return f"*IDN {IDENTITY}"
        if verb == "OFF" and not words:
            return self._off()
        if verb == "ON" and len(words) == 2:
            line_number = _number(words[0], 1, len(self._ids))
            return self._on(1 << (line_number - 1), words[1])
        if verb == "MASK" and len(words) == 2:
            return self._on(_number(words[0], 0, (1 << len(self._ids)) - 1), words[1])
        if verb == "STATE?" and len(words) == 1:
            return self._state(_number(words[0], 0, 65_535))
        if verb == "INTERLOCK?" and not words:
            return "INTERLOCK " + ("CLOSED" if self.interlock_closed else "OPEN")
        raise Refusal("1 unknown request")

    def _on(self, mask: int, lease: str) -> str:
        lease_ms = _number(lease, 1, LONGEST_LEASE_MS)
        if not self.interlock_closed:
            raise Refusal("3 interlock open")
        self._mask, self._ends = mask, self._clock() + lease_ms / 1000
        return f"ON {mask} {lease_ms}"

    def _off(self) -> str:
        if self.fault not in {"ignores_off", "hides_stuck_beam"}:
            self._mask = 0
        return "OFF"

    def _state(self, token: int) -> str:
        mask = 0 if self.fault == "hides_stuck_beam" else self._shining()
        left_ms = max(0, round((self._ends - self._clock()) * 1000)) if mask else 0
        return f"STATE {token} {mask} {left_ms}"

    def _shining(self) -> int:
        stuck = self.fault in {"ignores_off", "hides_stuck_beam"}
        leased = self.interlock_closed and self._clock() < self._ends
        if not (stuck or leased):
            self._mask = 0
        return self._mask


def _number(word: str, low: int, high: int) -> int:
    if not (word.isascii() and word.isdigit() and low <= int(word) <= high):
        raise Refusal(f"2 expected a number from {low} to {high}")
    return int(word)
