"""Window of live readings: drawn beside the measurement, which never waits."""

from __future__ import annotations

import threading

import pytest

from tests.viewer.session import a_rig
from workbench.cli import live_window
from workbench.cli.live_window import watching
from workbench.viewer.blueprint import blueprint


class Slow:
    """View that draws its first reading when it is released."""

    def __init__(self) -> None:
        self.began, self.released = threading.Event(), threading.Event()
        self.drawn: list[int] = []
        self.closed = False

    def take(self, shown: int) -> None:
        self.began.set()
        assert self.released.wait(10.0)
        self.drawn.append(shown)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Ports that viewers were opened for."""
    ports: list[int] = []
    monkeypatch.setattr(live_window, "watch", ports.append)
    return ports


def test_readings_that_come_while_one_is_drawn_are_skipped(opened: list[int]) -> None:
    view = Slow()
    with watching("live", blueprint(a_rig()), lambda _: view) as window:
        window.show(1)
        assert view.began.wait(10.0)
        for number in (2, 3, 4):
            window.show(number)
        view.released.set()
    assert view.drawn == [1, 2]
    assert view.closed
    assert len(opened) == 1


def test_a_view_that_hangs_does_not_keep_the_program(
    opened: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    view = Slow()
    monkeypatch.setattr(live_window, "PATIENCE_S", 0.05)
    with watching("live", blueprint(a_rig()), lambda _: view) as window:
        for number in range(3):
            window.show(number)
    view.released.set()
    assert not view.closed
    assert len(opened) == 1
