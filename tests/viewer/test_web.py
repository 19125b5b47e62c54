"""`workbench view --web`: viewer and recording on loopback, opened in a real browser."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import quote

import numpy as np

from tests.support.browser import Picture, headless_browser
from tests.viewer.conftest import Recorded
from workbench.model.chart import PALETTE
from workbench.viewer.window import LOOPBACK, free_port

START_S = 120.0
SERVE = """
import sys
from pathlib import Path
from workbench.viewer import window
ports = iter(map(int, sys.argv[2:]))
window.free_port = lambda: next(ports)
sys.exit(window.serve(Path(sys.argv[1]), print))
"""
LISTENING = "0A"
"""State of a socket in /proc/net/tcp."""


@contextmanager
def served(recording: Path, home: Path) -> Iterator[tuple[int, int]]:
    """Ports of the recording and of the web page."""
    ports = free_port(), free_port()
    command = [sys.executable, "-c", SERVE, str(recording), *map(str, ports)]
    process = subprocess.Popen(
        command,
        start_new_session=True,
        env={**os.environ, "HOME": str(home)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        for port in ports:
            wait_for(port)
        yield ports
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(START_S)


def wait_for(port: int) -> None:
    deadline = time.monotonic() + START_S
    while True:
        try:
            socket.create_connection((LOOPBACK, port), 1.0).close()
        except OSError:
            assert time.monotonic() < deadline, f"nothing listens on port {port}"
            time.sleep(0.1)
        else:
            return


def fetched(port: int, path: str) -> tuple[int, bytes]:
    """Status and content of a page."""
    connection = HTTPConnection(LOOPBACK, port, timeout=10.0)
    try:
        connection.request("GET", path)
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def addresses(port: int) -> set[str]:
    """Addresses, in hexadecimal, at which something listens on a port."""
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            _, local, _, state, *_ = line.split()
            address, _, number = local.rpartition(":")
            if state == LISTENING and int(number, 16) == port:
                found.add(address)
    return found


def test_viewer_and_recording_are_served_on_loopback_only(recorded: Recorded, tmp_path: Path) -> None:
    with served(recorded.recording, tmp_path) as (data, page):
        assert addresses(data) == addresses(page) == {"0100007F"}
        status, html = fetched(page, "/")
        assert status == 200
        assert b"<html" in html.lower()
        status, program = fetched(page, "/re_viewer_bg.wasm")
        assert (status, program[:4]) == (200, b"\0asm")


def test_a_browser_shows_the_recording(recorded: Recorded, tmp_path: Path) -> None:
    """The page starts without a graphics card, loads the recording and draws it in the lasers' colours."""
    with served(recorded.recording, tmp_path) as (data, page), headless_browser(tmp_path) as browser:
        source = quote(f"rerun+http://{LOOPBACK}:{data}/proxy", safe="")
        browser.open(f"http://{LOOPBACK}:{page}?url={source}")
        browser.wait_for(lambda picture: all(has_color(picture, color) for color in PALETTE[:4]))


def has_color(picture: Picture, color: str) -> bool:
    """Whether at least ten pixels are `#rrggbb`, to two of 255."""
    wanted = np.array([int(color[at : at + 2], 16) for at in (5, 3, 1)])
    return int(np.sum(np.all(np.abs(picture.astype(int) - wanted) <= 2, axis=2))) >= 10
