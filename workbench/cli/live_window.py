"""Window of live readings in the viewer: drawn beside the measurement, which never waits."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from workbench.viewer.window import free_port, watch

if TYPE_CHECKING:  # loads Rerun
    import rerun.blueprint as rrb

    from workbench.viewer.stream import Stream

PATIENCE_S = 5.0
"""Longest wait for the last reading to be drawn."""
T = TypeVar("T")
T_contra = TypeVar("T_contra", contravariant=True)


class View(Protocol[T_contra]):
    """View that logs readings to a served stream."""

    def take(self, shown: T_contra, /) -> None:
        """Log one reading."""

    def close(self) -> None:
        """Flush what is logged."""


class LiveWindow(Generic[T]):
    """Draws the latest reading in a thread; readings that come while it draws are skipped."""

    def __init__(self, view: View[T]) -> None:
        self._view = view
        self._waiting: queue.Queue[T | None] = queue.Queue(1)
        self._thread = threading.Thread(target=self._work, name="live window", daemon=True)
        self._thread.start()

    def show(self, shown: T) -> None:
        """Draw a reading, unless an earlier one is still waiting."""
        with suppress(queue.Full):
            self._waiting.put_nowait(shown)

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
def watching(
    name: str, layout: rrb.Blueprint, view_on: Callable[[Stream], View[T]]
) -> Iterator[LiveWindow[T]]:
    """Open the viewer on a stream of readings.

    Args:
        name: name of the stream.
        layout: layout in the viewer.
        view_on: makes the view on the stream.

    Raises:
        BadInputError: the viewer is not installed.
    """
    from workbench.viewer.stream import Stream

    port = free_port()
    window = LiveWindow(view_on(Stream(None, name, layout, port)))
    try:
        watch(port)
        yield window
    finally:
        window.close()
