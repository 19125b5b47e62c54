"""The controller's line on a pseudo-terminal: bytes there and back, and the hang-up."""

from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import pytest

from workbench.emulator.pty import PtyServer

PATIENCE_S = 10.0


@contextmanager
def line(server: PtyServer) -> Iterator[int]:
    handle = os.open(server.port, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(handle)
        yield handle
    finally:
        os.close(handle)


def read(handle: int, count: int) -> bytes:
    """So many bytes, or fewer where no more come."""
    found = b""
    while len(found) < count and select.select([handle], [], [], PATIENCE_S)[0]:
        found += os.read(handle, count - len(found))
    return found


def test_answers_come_back_byte_for_byte() -> None:
    server = PtyServer(lambda request: request.upper())
    try:
        with line(server) as handle:
            os.write(handle, b"on 1\n\r\x03\x04\x7f\xff")
            assert read(handle, 10) == b"ON 1\n\r\x03\x04\x7f\xff"
    finally:
        server.close()


def test_two_lines_do_not_hear_each_other() -> None:
    def answer(own: bytes, request: bytes) -> bytes:
        return own + request

    servers = [PtyServer(partial(answer, own)) for own in (b"0:", b"1:")]
    try:
        assert servers[0].port != servers[1].port
        with line(servers[0]) as first, line(servers[1]) as second:
            os.write(second, b"a")
            os.write(first, b"b")
            assert (read(first, 3), read(second, 3)) == (b"0:b", b"1:a")
    finally:
        for server in servers:
            server.close()


def test_answers_that_nobody_reads_do_not_hold_the_controller_up() -> None:
    heard = threading.Semaphore(0)

    def receive(request: bytes) -> bytes:
        for _ in request:
            heard.release()
        return b"x" * 4096

    server = PtyServer(receive)
    try:
        with line(server) as handle:
            for _ in range(100):  # 400 kB of answers, far more than a terminal keeps
                os.write(handle, b"?")
                assert heard.acquire(timeout=PATIENCE_S)
    finally:
        server.close()


def test_after_the_hang_up_the_line_is_dead_and_closing_again_does_nothing() -> None:
    server = PtyServer(lambda request: request)
    with line(server) as handle:
        server.close()
        server.close()
        with pytest.raises(OSError, match="Input/output error"):
            os.write(handle, b"a")
