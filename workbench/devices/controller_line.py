"""The laser driver `serial`: a controller that speaks docs/laser-controller.md, on a serial line."""

from __future__ import annotations

import os
import select
import termios
import time
from collections.abc import Callable
from typing import Annotated, ClassVar

import serial
from pydantic import Field

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError

REPLY_S = 1.0
"""Longest wait for a reply, s: controllers answer within milliseconds, a busy computer passes it on later."""
LONGEST_REPLY = 200
LOOK_S = 0.02
"""Time between two calls of `alarm` while a reply is awaited, s."""
LINE_FAILURES = (serial.SerialException, OSError, termios.error)
"""Errors of a line that hangs up, depending on the call under way."""


class SerialBlock(DeviceBlock):
    """The block `devices: lasers:` of the rig file."""

    port: str
    """Of the controller."""
    baud: Annotated[int, Field(gt=0)] = 115_200


class ControllerLine:
    """Requests and replies; see `guarded_line.GuardedLine`."""

    settings_type: ClassVar = SerialBlock
    has_leases: ClassVar[bool] = True

    def __init__(self, settings: SerialBlock, lasers: int, alarm: Callable[[], bool]) -> None:
        """Open the port, exclusively.

        `alarm` is asked while the reply to a request that lights is waited for; when it says so, off is
        sent at once. A controller with fewer lines than `lasers` refuses to light the last ones.

        Raises:
            RigNotReadyError: no such port, or another program holds it.
        """
        self._token = 0
        self._alarm = alarm
        try:
            self._line = serial.Serial(
                settings.port, settings.baud, timeout=0, write_timeout=REPLY_S, exclusive=True
            )
        except LINE_FAILURES as error:
            raise RigNotReadyError(
                f"laser controller: expected a serial port at {settings.port}, got: {error};"
                " check the cable, and that no other program holds the port"
            ) from None

    def identify(self, boot_s: float) -> str:
        """Identity of the controller. One that boots when its port is opened has `boot_s` to answer.

        Raises:
            RigNotReadyError: nothing answers as expected.
        """
        deadline = time.monotonic() + boot_s
        while True:
            try:
                # Off first: another program may have left lasers on.
                self._request("!", "OFF")
                return self._request("*IDN?", "*IDN")
            except RigNotReadyError:
                if time.monotonic() >= deadline:
                    raise

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off, for a lease.

        Raises:
            RigNotReadyError: refused, not answered, or switched off again by an alarm.
        """
        self._request(f"MASK {mask} {lease_ms}", f"ON {mask} {lease_ms}", self._alarm)

    def all_off(self) -> None:
        """Switch every laser off and ask the controller whether it did; tried twice.

        Raises:
            LaserOffNotConfirmedError: it did not confirm that.
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

    def state(self) -> tuple[int, bool]:
        """Mask of what is on now, and whether the interlock is closed.

        Raises:
            RigNotReadyError: not answered.
        """
        mask, _ = self._ask_state().split(" ")
        return int(mask), self._request("INTERLOCK?", "INTERLOCK") == "CLOSED"

    def close(self) -> None:
        """Release the port."""
        self._line.close()

    def _expect_dark(self) -> None:
        state = self._ask_state()
        if state != "0 0":
            raise self._unexpected("STATE?", f"OK STATE {self._token} 0 0 (all off)", f"OK STATE ... {state}")

    def _ask_state(self) -> str:
        # A number of its own: the answer to an earlier question does not answer this one.
        self._token = (self._token + 1) % 65_536
        return self._request(f"STATE? {self._token}", f"STATE {self._token}")

    def _request(self, request: str, expected: str, alarm: Callable[[], bool] = lambda: False) -> str:
        """One request, one reply `OK <expected>[ <rest>]`; returns the rest."""
        try:
            self._line.reset_input_buffer()
            self._line.write(request.encode() if request == "!" else f"{request}\n".encode())
            came = self._receive(alarm)
        except LINE_FAILURES as error:
            raise self._unexpected(request, f"OK {expected}", f"a dead line ({error})") from None
        reply = came.decode("ascii", errors="backslashreplace")
        head = f"OK {expected}"
        if not (reply.endswith("\n") and f"{reply.rstrip()} ".startswith(f"{head} ")):
            raise self._unexpected(request, head, repr(reply) if came else f"nothing within {REPLY_S} s")
        return reply.rstrip()[len(head) + 1 :]

    def _receive(self, alarm: Callable[[], bool]) -> bytes:
        """One line, or what came of it in `REPLY_S`; after an alarm all lines up to the answer to off."""
        came, end = b"", b"\n"
        deadline = time.monotonic() + REPLY_S
        while end not in came and len(came) < LONGEST_REPLY and time.monotonic() < deadline:
            if end == b"\n" and alarm():
                self._line.write(b"!")
                end = b"OK OFF\n"
            ready, _, _ = select.select([self._line], [], [], LOOK_S)
            if ready:
                part = os.read(self._line.fileno(), LONGEST_REPLY)
                if not part:
                    raise OSError("it hung up")
                came += part
        whole, found, _ = came.partition(end)
        return whole + found

    def _unexpected(self, request: str, expected: str, came: str) -> RigNotReadyError:
        return RigNotReadyError(
            f"laser controller at {self._line.port}: asked {request!r}, expected {expected!r}, got {came};"
            " check cable, baud rate, interlock and the controller's power"
        )
