"""Requests and replies on the serial line, without the guardian; its faults are in test_serial_faults."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from workbench.devices.controller_line import ControllerLine, SerialBlock
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


def test_a_closed_line_asks_nothing_more(controller: Controller, port: str) -> None:
    line = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    assert line.state() == (0, True)
    line.close()
    with pytest.raises(RigNotReadyError):
        line.state()
    again = ControllerLine(SerialBlock(port=port), 4, lambda: False)
    assert again.state() == (0, True)
    again.close()
