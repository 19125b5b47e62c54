"""Serial line without hardware: a thread that connects a controller to a pseudo-terminal."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty
from collections.abc import Callable


class PtyServer:
    """Server of `receive` (bytes in, bytes out) on a pseudo-terminal."""

    def __init__(self, receive: Callable[[bytes], bytes]) -> None:
        self._receive = receive
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.port = os.ttyname(self._theirs)
        """Device path for the client."""
        self._wake, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._serve, name="laser controller", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Disconnect, which the client sees as a line failure. A second call has no effect."""
        if not self._thread.is_alive():
            return
        os.write(self._waker, b"x")
        self._thread.join()
        for descriptor in (self._ours, self._theirs, self._wake, self._waker):
            with contextlib.suppress(OSError):
                os.close(descriptor)

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._ours, self._wake], [], [])
            if self._wake in ready:
                return
            answer = self._receive(os.read(self._ours, 4096))
            # Unread answers are lost, as on a real line, and must not block the thread.
            with contextlib.suppress(BlockingIOError):
                os.write(self._ours, answer)
