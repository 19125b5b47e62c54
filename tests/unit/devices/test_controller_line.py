"""Requests and replies on the serial line, without the guardian; its faults are in test_serial_faults."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from workbench.devices.controller_line import REPLY_S, ControllerLine, SerialBlock
from workbench.emulator.controller import IDENTITY, Controller
from workbench.emulator.pty import PtyServer
from workbench.emulator.spec import ControllerSpec
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError

IDS = ("L1", "L2", "L3", "L4")


@pytest.fixture
def controller() -> Controller:
    return Controller(IDS, ControllerSpec())


@pytest.fixture
def port(controller: Controller) -> Iterator[str]:
    server = PtyServer(controller.receive)
    yield server.port
    server.close()


def test_state_is_what_the_outputs_do(controller: Controller, port: str) -> None:
    line = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    controller.receive(b"MASK 15 60000\n")
    assert line.identify(boot_s=0.0) == IDENTITY
    assert line.state() == (0, True), "identify puts off what was left on"
    line.light(0b1010, 60_000)
    assert line.state() == (0b1010, True)
    assert controller.lit() == ("L2", "L4")
    line.all_off()
    controller.interlock_closed = False
    assert line.state() == (0, False)
    with pytest.raises(RigNotReadyError):
        line.light(1, 100)
    line.close()


def test_an_off_that_the_controller_does_not_confirm(controller: Controller, port: str) -> None:
    line = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    line.light(1, 60_000)
    controller.fault = "ignores_off"
    with pytest.raises(LaserOffNotConfirmedError):
        line.all_off()
    line.close()


def test_an_alarm_while_lighting_puts_off_at_once(controller: Controller, port: str) -> None:
    line = ControllerLine(SerialBlock(port=port), 4, lambda: True)
    with pytest.raises(RigNotReadyError):
        line.light(0b11, 60_000)
    assert controller.lit() == ()
    line.close()


def test_a_late_reply_is_not_taken_for_that_to_off(controller: Controller) -> None:
    """The state comes when off has been sent again: off is confirmed, not in doubt."""
    asked: list[bytes] = []

    def receive(data: bytes) -> bytes:
        asked.append(data)
        if data.startswith(b"STATE") and sum(one.startswith(b"STATE") for one in asked) == 1:
            time.sleep(1.3 * REPLY_S)
        return controller.receive(data)

    server = PtyServer(receive)
    line = ControllerLine(SerialBlock(port=server.port), 4, lambda: False)
    line.light(1, 60_000)
    line.all_off()
    assert controller.lit() == ()
    assert [one[:5] for one in asked[1:]] == [b"!", b"STATE", b"!", b"STATE"]
    line.close()
    server.close()


def test_a_late_reply_to_on_is_neither_the_reply_to_off_nor_a_failure(controller: Controller) -> None:
    asked: list[bytes] = []

    def receive(data: bytes) -> bytes:
        asked.append(data)
        if data.startswith(b"MASK"):
            time.sleep(1.1 * REPLY_S)
        return controller.receive(data)

    server = PtyServer(receive)
    line = ControllerLine(SerialBlock(port=server.port), 4, lambda: False)
    with pytest.raises(RigNotReadyError, match="nothing within"):
        line.light(1, 60_000)
    line.all_off()
    assert controller.lit() == ()
    assert b"".join(asked).startswith(b"MASK 1 60000\n!STATE?"), "off was asked for once"
    line.close()
    server.close()


@pytest.mark.skipif(os.getuid() != 0, reason="only root can open a port as another user")
def test_another_user_cannot_open_the_port_while_it_is_held(port: str) -> None:
    Path(port).chmod(0o666)
    script = "import os, sys; os.setuid(65534); os.close(os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY))"
    opening = [sys.executable, "-c", script, port]
    line = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    held = subprocess.run(opening, capture_output=True, text=True)
    line.close()
    free = subprocess.run(opening, capture_output=True, text=True)
    assert (held.returncode, free.returncode) == (1, 0), free.stderr
    assert "busy" in held.stderr


def test_a_closed_line_asks_nothing_more(controller: Controller, port: str) -> None:
    line = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    assert line.state() == (0, True)
    line.close()
    with pytest.raises(RigNotReadyError):
        line.state()
    again = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    assert again.state() == (0, True)
    again.close()
