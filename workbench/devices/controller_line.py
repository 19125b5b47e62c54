"""Laser driver `serial`: a controller with the protocol of docs/laser-controller.md on a serial line."""

from __future__ import annotations

import fcntl
import os
import select
import termios
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, ClassVar

import serial
from pydantic import Field

from workbench.model.device_block import DeviceBlock
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError

REPLY_S = 2.5
"""Longest wait for a reply, s. Controllers answer within milliseconds, but a busy computer delivers late.
Bytes of a serial line pass a kernel thread of ordinary priority, which took up to 1.6 s at a load of 20 on
two cores. The controller's leases are shorter, so that no emission lasts longer for it."""
BOOT_REPLY_S = 1.0
"""Longest wait for a reply of a controller that may be booting, and is asked again, s."""
LONGEST_REPLY = 200
STATE, INTERLOCK, ON, OFF = b"OK STATE ", b"OK INTERLOCK ", b"OK ON ", b"OK OFF\n"
LOOK_S = 0.02
"""Time between two calls of `alarm` while a reply is awaited, s."""
LINE_FAILURES = (serial.SerialException, OSError, termios.error)
"""Errors of a disconnected line; which one depends on the call under way."""


class SerialBlock(DeviceBlock):
    """Block `devices: lasers:` of the rig file."""

    port: str
    """Serial port of the controller."""
    baud: Annotated[int, Field(gt=0)] = 115_200


class ControllerLine:
    """Laser driver with requests and replies; see `guarded_line.GuardedLine`."""

    settings_type: ClassVar = SerialBlock
    has_leases: ClassVar[bool] = True

    def __init__(self, settings: SerialBlock, lasers: int, alarm: Callable[[], bool]) -> None:
        """Open the port, exclusively.

        `alarm` is called while waiting for the reply to a request that switches lasers on; if it returns
        true, off is sent at once. A controller with fewer lines than `lasers` refuses the missing ones.

        Raises:
            RigNotReadyError: there is no such port, or another program holds it.
        """
        self._token = 0
        self._alarm = alarm
        try:
            self._line = serial.Serial(
                settings.port, settings.baud, timeout=0, write_timeout=REPLY_S, exclusive=True
            )
            # The lock of `exclusive` keeps out programs that look for it; this keeps out every other user's.
            fcntl.ioctl(self._line.fileno(), termios.TIOCEXCL)
        except LINE_FAILURES as error:
            raise RigNotReadyError(
                f"laser controller: expected a serial port at {settings.port}, got: {error};"
                " check the cable and that no other program holds the port"
            ) from None

    def identify(self, boot_s: float) -> str:
        """Identity of the controller, which has `boot_s` to boot after its port was opened.

        Raises:
            RigNotReadyError: there is no valid answer.
        """
        deadline = time.monotonic() + boot_s
        while True:
            try:
                # Off first, because another program may have left lasers on.
                self._request("!", "OFF", within_s=BOOT_REPLY_S)
                return self._request("*IDN?", "*IDN", within_s=BOOT_REPLY_S)
            except RigNotReadyError:
                if time.monotonic() >= deadline:
                    raise

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off, for a lease.

        Raises:
            RigNotReadyError: the request is refused or not answered, or an alarm switched the lasers off.
        """
        self._request(f"MASK {mask} {lease_ms}", f"ON {mask} {lease_ms}", self._alarm)

    def all_off(self) -> None:
        """Switch every laser off and verify the controller's state; tried twice.

        Raises:
            LaserOffNotConfirmedError: the controller did not confirm it.
        """
        cause = ""
        for _ in range(2):
            try:
                self._request("!", "OFF")
                self._expect_dark()
            except RigNotReadyError as error:
                cause = str(error)
            else:
                return
        raise LaserOffNotConfirmedError(
            f"the lasers may be on: {cause}; treat the beams as on; cut the controller's power"
        )

    def state(self) -> tuple[int, bool]:
        """Mask of the lasers that are on, and whether the interlock is closed.

        Raises:
            RigNotReadyError: the controller does not answer.
        """
        mask, _ = self._ask_state().split(" ")
        return int(mask), self._request("INTERLOCK?", "INTERLOCK") == "CLOSED"

    def close(self) -> None:
        """Release the port."""
        with suppress(*LINE_FAILURES):  # disconnected
            fcntl.ioctl(self._line.fileno(), termios.TIOCNXCL)
        self._line.close()

    def _expect_dark(self) -> None:
        state = self._ask_state()
        if state != "0 0":
            raise self._unexpected("STATE?", f"OK STATE {self._token} 0 0 (all off)", f"OK STATE ... {state}")

    def _ask_state(self) -> str:
        # A new number for each question, so that a late answer to an earlier one is recognised.
        self._token = (self._token + 1) % 65_536
        return self._request(f"STATE? {self._token}", f"STATE {self._token}")

    def _request(
        self,
        request: str,
        expected: str,
        alarm: Callable[[], bool] = lambda: False,
        within_s: float = REPLY_S,
    ) -> str:
        """Send a request and receive its reply `OK <expected>[ <rest>]`; returns the rest."""
        try:
            self._line.reset_input_buffer()
            self._line.write(request.encode() if request == "!" else f"{request}\n".encode())
            received = self._receive(alarm, f"OK {expected}", within_s)
        except LINE_FAILURES as error:
            raise self._unexpected(request, f"OK {expected}", f"a line failure ({error})") from None
        reply = received.decode("ascii", errors="backslashreplace")
        head = f"OK {expected}"
        if not (reply.endswith("\n") and f"{reply.rstrip()} ".startswith(f"{head} ")):
            raise self._unexpected(request, head, repr(reply) if received else f"nothing within {within_s} s")
        return reply.rstrip()[len(head) + 1 :]

    def _receive(self, alarm: Callable[[], bool], head: str, within_s: float) -> bytes:
        """Receive one line, possibly incomplete after `within_s`; after an alarm, up to the reply to off.

        Late replies to earlier requests for the state are skipped, and by off and its check those to on and
        off, too.
        """
        received, end, wanted = b"", b"\n", head.encode()
        checks_off = wanted.startswith((STATE, OFF.rstrip()))
        late = (STATE, INTERLOCK, ON, OFF) if checks_off else (STATE, INTERLOCK)
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            while end == b"\n" in received and received.startswith(late) and not received.startswith(wanted):
                received = received.partition(b"\n")[2]
            if end in received or len(received) >= LONGEST_REPLY:
                break
            if end == b"\n" and alarm():
                self._line.write(b"!")
                end = OFF
            ready, _, _ = select.select([self._line], [], [], LOOK_S)
            if ready:
                part = os.read(self._line.fileno(), LONGEST_REPLY)
                if not part:
                    raise OSError("disconnected")
                received += part
        whole, found, _ = received.partition(end)
        return whole + found

    def _unexpected(self, request: str, expected: str, got: str) -> RigNotReadyError:
        return RigNotReadyError(
            f"laser controller at {self._line.port}: request {request!r}: expected {expected!r}, got {got};"
            " check cable, baud rate, interlock and the controller's power"
        )
