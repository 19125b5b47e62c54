"""Window of `workbench range --view`: readings are drawn beside the ranging, which never waits."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from workbench.model.arrays import Image
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.ranging.ranger import Ranger, Reading
from workbench.viewer.window import free_port, watch

PATIENCE_S = 5.0
"""Longest wait for the last reading to be drawn."""


class LiveWindow:
    """Draws the latest reading in a thread; readings that come while it draws are skipped."""

    def __init__(self, rig: Rig, ranger: Ranger, port: int) -> None:
        from workbench.viewer.ranger_view import RangerView, Shown, ranger_layout
        from workbench.viewer.stream import Stream

        stream = Stream(None, f"range {rig.rig}", ranger_layout(rig), port)
        self._shown = Shown
        self._view = RangerView(stream, rig, ranger)
        self._waiting: queue.Queue[Shown | None] = queue.Queue(1)
        self._thread = threading.Thread(target=self._work, name="live window", daemon=True)
        self._thread.start()

    def show(self, reading: Reading, on: Image, off: Image, spots: tuple[Spot, ...]) -> None:
        """Draw a reading, unless an earlier one is still waiting."""
        with suppress(queue.Full):
            self._waiting.put_nowait(self._shown(reading, on, off, spots))

    def close(self) -> None:
        """Draw what is waiting, and end."""
        with suppress(queue.Full):
            self._waiting.put(None, timeout=PATIENCE_S)
        self._thread.join(PATIENCE_S)

    def _work(self) -> None:
        while (shown := self._waiting.get()) is not None:
            self._view.take(shown)
        self._view.close()


@contextmanager
def watching(rig: Rig, ranger: Ranger) -> Iterator[LiveWindow]:
    """A window on the readings in the viewer, which is opened.

    Raises:
        BadInputError: the viewer is not installed.
    """
    port = free_port()
    window = LiveWindow(rig, ranger, port)
    try:
        watch(port)
        yield window
    finally:
        window.close()
