"""The firmware on a serial line, measured at its pins: in the simulated chip, and as a program."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from tests.firmware.parts import Running, build
from tests.support.lasers import serial_bank

IDS = ("L1", "L2", "L3", "L4")


@pytest.fixture
def line(controller: Running) -> Iterator[serial.Serial]:
    with serial.Serial(controller.port, 115_200, timeout=10.0) as line:
        yield line


def ask(line: serial.Serial, request: bytes) -> str:
    line.write(request)
    return line.readline().decode("ascii").rstrip("\n")


def test_it_boots_off_and_says_who_it_is(controller: Running, line: serial.Serial) -> None:
    who = ask(line, b"*IDN?\n")
    assert who.startswith("OK *IDN laser-range-workbench,")
    assert len(who.split(",")) == 4
    assert ask(line, b"STATE? 1\n") == "OK STATE 1 0 0"
    assert [change.lines for change in controller.changes()] == [0]


@pytest.mark.parametrize(
    ("request_", "lines"), [(b"ON 1 9999\n", 1), (b"ON 4 9999\n", 8), (b"MASK 10 9999\n", 10)]
)
def test_each_line_has_its_pin(controller: Running, line: serial.Serial, request_: bytes, lines: int) -> None:
    assert ask(line, request_).startswith(f"OK ON {lines} ")
    controller.wait_for(lines)
    assert ask(line, b"STATE? 3\n").startswith(f"OK STATE 3 {lines} ")
    assert ask(line, b"!") == "OK OFF"
    assert controller.lines() == 0  # it was said of pins that are off
    assert [change.lines for change in controller.changes()] == [0, lines, 0]


@pytest.mark.parametrize("lease_ms", [20, 300])
def test_the_lease_ends_by_itself(controller: Running, line: serial.Serial, lease_ms: int) -> None:
    asked_ns = time.monotonic_ns()
    ask(line, b"MASK 15 %d\n" % lease_ms)
    on = controller.wait_for(15)
    off = controller.wait_for(0)
    print(f"lease of {lease_ms} ms: lit for {(off.time_ns - on.time_ns) / 1e6:.1f} ms")
    # It begins when the request has arrived and is told in whole milliseconds, so it may be one short. The
    # simulator and the program may be late by what a busy computer keeps them from.
    assert lease_ms - 1.5 < (off.time_ns - asked_ns) / 1e6 < lease_ms + 250


def test_bang_amid_a_line(controller: Running, line: serial.Serial) -> None:
    ask(line, b"ON 2 9999\n")
    line.write(b"MASK 15 99")
    assert ask(line, b"!") == "OK OFF"
    assert controller.lines() == 0
    assert ask(line, b"99\n") == "ERR 1 unknown request"
    assert controller.lines() == 0


def test_open_interlock(controller: Running, line: serial.Serial) -> None:
    ask(line, b"ON 1 9999\n")
    controller.wait_for(1)
    controller.toggle_interlock()
    controller.wait_for(0)
    assert ask(line, b"INTERLOCK?\n") == "OK INTERLOCK OPEN"
    assert ask(line, b"ON 1 9999\n") == "ERR 3 interlock open"
    controller.toggle_interlock()
    while ask(line, b"INTERLOCK?\n") != "OK INTERLOCK CLOSED":
        pass
    assert controller.lines() == 0  # closing it lights nothing
    assert ask(line, b"ON 1 9999\n") == "OK ON 1 9999"


def test_a_flood_of_garbage_lights_nothing_and_is_survived(controller: Running, line: serial.Serial) -> None:
    for _ in range(20):
        line.write(bytes(range(256)) * 2)
        line.reset_input_buffer()
    line.write(b"\n")
    deadline = time.monotonic() + 20
    while ask(line, b"STATE? 77\n") != "OK STATE 77 0 0":
        assert time.monotonic() < deadline
    assert {change.lines for change in controller.changes()} == {0}


def test_a_reply_that_nobody_reads_does_not_hold_up_the_lease(
    controller: Running, line: serial.Serial
) -> None:
    line.write(b"ON 1 200\n" + b"*IDN?\n" * 100)
    controller.wait_for(1)
    controller.wait_for(0)


def test_the_driver(controller: Running) -> None:
    bank = serial_bank(controller.port, IDS)
    with bank.lit(["L2", "L3"], for_s=5.0):
        assert controller.lines() == 6
    assert controller.lines() == 0
    bank.close()


def test_the_watchdog_boots_a_program_that_hangs(tmp_path: Path) -> None:
    """Built with an endless loop on the byte BEL: the lease's end would never be looked at."""
    build("hanging", tmp_path)
    chip = Running("chip", tmp_path, tmp_path / "pins.log", "hanging.elf")
    try:
        with serial.Serial(chip.port, 115_200, timeout=10.0) as line:
            ask(line, b"ON 1 60000\n")
            chip.wait_for(1)
            hung_ns = time.monotonic_ns()
            line.write(b"\a")
            off = chip.wait_for(0)
            print(f"off {(off.time_ns - hung_ns) / 1e6:.1f} ms after the program hung")
            assert (off.time_ns - hung_ns) / 1e6 < 300  # the watchdog's 30 ms, and what a busy computer takes
            line.timeout = 0.5  # what is sent while it boots is lost
            while (state := ask(line, b"STATE? 1\n")) != "OK STATE 1 0 0":
                assert time.monotonic_ns() < hung_ns + 10e9, state
    finally:
        chip.stop()
