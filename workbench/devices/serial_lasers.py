"""Lasers behind a serial line: the driver of any controller that speaks docs/laser-controller.md."""

from __future__ import annotations

import contextlib
import math
import termios
import time
from collections.abc import Iterator, Sequence

import serial

from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError

REPLY_S = 0.5
"""A controller answers within milliseconds; after this it is not going to."""
LONGEST_REPLY = 200
LINE_FAILURES = (serial.SerialException, OSError, termios.error)
"""A line that hangs up shows as any of these, depending on the call under way."""


class SerialLaserBank:
    """The lasers `ids`, in the order of the controller's lines 1, 2, ...; see `protocols.LaserBank`."""

    def __init__(self, port: str, ids: Sequence[str], baud: int = 115_200, boot_s: float = 3.0) -> None:
        """Open the port and put every laser off.

        A controller that starts anew when its port is opened (an Arduino does) has `boot_s` to answer.

        Raises:
            RigNotReadyError: no such port, another program holds it, or nobody answers as expected.
            LaserOffNotConfirmedError: the controller answers, but not that all are off.
        """
        self.ids = tuple(ids)
        self._token = 0
        try:
            self._line = serial.Serial(port, baud, timeout=REPLY_S, write_timeout=REPLY_S, exclusive=True)
        except LINE_FAILURES as error:
            raise RigNotReadyError(
                f"laser controller: expected a serial port at {port}, got: {error};"
                " check the cable, and that no other program holds the port"
            ) from None
        try:
            self.identity = self._identify(boot_s)
            self.all_off()
        except BaseException:
            self._line.close()
            raise

    @contextlib.contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        """Hold `ids` lit inside the block, `for_s` seconds at the most; see `protocols.LaserBank`."""
        mask = self._mask(ids)
        lease_ms = math.ceil(for_s * 1000)
        try:
            self._request(f"MASK {mask} {lease_ms}", f"ON {mask} {lease_ms}")
            yield
        finally:
            self.all_off()

    def all_off(self) -> None:
        """Put every laser off and ask the controller whether it did; tried twice.

        Raises:
            LaserOffNotConfirmedError: it did not say so.
        """
        came = ""
        for _ in range(2):
            try:
                self._request("!", "OFF")
                self._expect_dark()
            except RigNotReadyError as error:
                came = str(error)
            else:
                return
        raise LaserOffNotConfirmedError(
            f"the lasers may be on: {came}; treat the beams as on, cut the controller's power"
        )

    def close(self) -> None:
        """All off, then release the port; the errors of `all_off`."""
        if not self._line.is_open:
            return
        try:
            self.all_off()
        finally:
            self._line.close()

    def _mask(self, ids: Sequence[str]) -> int:
        unknown = [name for name in ids if name not in self.ids]
        if unknown or not ids:
            raise BadInputError(f"lasers to light: expected some of {', '.join(self.ids)}, got {list(ids)}")
        return sum(1 << self.ids.index(name) for name in set(ids))

    def _identify(self, boot_s: float) -> str:
        deadline = time.monotonic() + boot_s
        while True:
            try:
                # Off comes first: whoever answers, and whatever a program before this one left lit.
                self._request("!", "OFF")
                return self._request("*IDN?", "*IDN")
            except RigNotReadyError:
                if time.monotonic() >= deadline:
                    raise

    def _expect_dark(self) -> None:
        # A number of its own: the answer to an earlier question does not confirm this one.
        self._token = (self._token + 1) % 65_536
        state = self._request(f"STATE? {self._token}", f"STATE {self._token}")
        if state != "0 0":
            raise self._unexpected("STATE?", f"OK STATE {self._token} 0 0 (all off)", f"OK STATE ... {state}")

    def _request(self, request: str, expected: str) -> str:
        """One request, one reply `OK <expected>[ <rest>]`; returns the rest."""
        try:
            self._line.reset_input_buffer()
            self._line.write(request.encode() if request == "!" else f"{request}\n".encode())
            came = self._line.read_until(b"\n", LONGEST_REPLY)
        except LINE_FAILURES as error:
            raise self._unexpected(request, f"OK {expected}", f"a dead line ({error})") from None
        reply = came.decode("ascii", errors="backslashreplace")
        head = f"OK {expected}"
        if not (reply.endswith("\n") and f"{reply.rstrip()} ".startswith(f"{head} ")):
            raise self._unexpected(request, head, repr(reply) if came else f"nothing within {REPLY_S} s")
        return reply.rstrip()[len(head) + 1 :]

    def _unexpected(self, request: str, expected: str, came: str) -> RigNotReadyError:
        return RigNotReadyError(
            f"laser controller at {self._line.port}: asked {request!r}, expected {expected!r}, got {came};"
            " check cable, baud rate, interlock and the controller's power"
        )
