"""Window of live readings: drawn beside the ranging, which never waits."""

from __future__ import annotations

import threading
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.viewer.session import a_rig
from workbench.cli import live_window
from workbench.cli.live_window import LiveWindow, watching
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.sensor.usable import load_usable
from workbench.spots import Finding
from workbench.viewer.ranger_view import RangerView, Shown

FRAME = np.zeros((480, 640), np.uint8)


class SlowView(RangerView):
    """View that takes its first reading when it is released."""

    released = threading.Event()
    began = threading.Event()
    drawn: list[Reading]

    def take(self, shown: Shown) -> None:
        self.began.set()
        assert self.released.wait(10.0)
        self.drawn.append(shown.reading)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Ports that viewers were opened for."""
    ports: list[int] = []
    monkeypatch.setattr(live_window, "watch", ports.append)
    return ports


@cache
def a_ranger() -> Ranger:
    return Ranger(load_usable(Path(__file__).parents[3] / "data/session-0.1.0/calibration.yaml"))


def show(window: LiveWindow, reading: Reading) -> None:
    window.show(reading, FRAME, FRAME, ())


def reading() -> Reading:
    return acquire(a_ranger(), "s", lambda _: Finding(()))


def test_readings_that_come_while_one_is_drawn_are_skipped(
    opened: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Reading] = []
    monkeypatch.setattr(SlowView, "drawn", drawn, raising=False)
    monkeypatch.setattr("workbench.viewer.ranger_view.RangerView", SlowView)
    readings = [reading() for _ in range(4)]
    with watching(a_rig(), a_ranger()) as window:
        show(window, readings[0])
        assert SlowView.began.wait(10.0)
        for one in readings[1:]:
            show(window, one)
        SlowView.released.set()
    assert drawn == readings[:2]
    assert len(opened) == 1


def test_a_view_that_hangs_does_not_keep_the_program(
    opened: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    hang = threading.Event()
    monkeypatch.setattr(live_window, "PATIENCE_S", 0.05)
    monkeypatch.setattr("workbench.viewer.ranger_view.RangerView.take", lambda *_: hang.wait(10.0))
    with watching(a_rig(), a_ranger()) as window:
        for _ in range(3):
            show(window, reading())
    hang.set()
    assert len(opened) == 1
