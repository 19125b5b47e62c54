"""The recording as it is watched: by the real viewer, by none, by one that hangs."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.viewer.harness import headless_viewer
from tests.viewer.readback import Contents
from tests.viewer.session import MadeUpSession, a_rig
from workbench.viewer import window
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

SLOWEST_S = 20.0
"""Longest time of one record with a viewer that does not read. A stream that waits for it waits for ever."""


def test_the_real_viewer_shows_a_running_session(tmp_path: Path) -> None:
    records = list(MadeUpSession(tmp_path).records())
    ports: list[int] = []
    with RecordingConsumer(tmp_path, a_rig(), watch=ports.append) as consumer:
        for record in records[: len(records) // 2]:
            consumer(record)
        (port,) = ports
        with headless_viewer(tmp_path) as viewer:
            viewer.open_url(f"rerun+http://{window.LOOPBACK}:{port}/proxy")
            assert len(viewer.state().recordings) == 1
            for record in records[len(records) // 2 :]:
                consumer(record)
            viewer.shot()
            assert viewer.problems() == []


def test_a_session_that_nobody_watches_is_recorded_the_same(tmp_path: Path) -> None:
    records = list(MadeUpSession(tmp_path).records())
    contents = []
    for name, watch in (("plain", None), ("watched", lambda _: None)):
        out = tmp_path / f"{name}.rrd"
        with RecordingConsumer(tmp_path, a_rig(), out, watch=watch) as consumer:
            for record in records:
                consumer(record)
        contents.append(Contents(out).everything())
    assert contents[0] == contents[1]


def test_a_viewer_that_hangs_does_not_stop_the_recording(tmp_path: Path) -> None:
    records = list(MadeUpSession(tmp_path).records())
    started: list[subprocess.Popen[bytes]] = []

    def watch(port: int) -> None:
        home = tmp_path / "home"
        home.mkdir()
        command = [str(window.viewer_executable()), "--headless", "--bind", window.LOOPBACK, "--port", "0"]
        command += ["--connect", f"rerun+http://{window.LOOPBACK}:{port}/proxy"]
        process = subprocess.Popen(
            command,
            env={**window.viewer_environment(), "HOME": str(home)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        started.append(process)

    slowest = 0.0
    with RecordingConsumer(tmp_path, a_rig(), watch=watch) as consumer:
        try:
            for number, record in enumerate(8 * records[:-1]):
                if number == 5:
                    os.kill(started[0].pid, signal.SIGSTOP)
                if number and record.n == 0:
                    continue  # the session starts once
                before = time.monotonic()
                consumer(record)
                slowest = max(slowest, time.monotonic() - before)
            consumer(records[-1])
        finally:
            started[0].kill()
            started[0].wait()
    assert slowest < SLOWEST_S
    assert window.is_complete(tmp_path / RECORDING_FILE)


@pytest.mark.parametrize("content", [b"", b"RRF2FOOT" + bytes(100)])
def test_a_file_without_a_footer_at_its_end_is_incomplete(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "r.rrd"
    path.write_bytes(content)
    assert not window.is_complete(path)
    assert not window.is_complete(tmp_path / "none.rrd")
