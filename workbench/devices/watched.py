"""Camera with a time limit on every call."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from workbench.devices.protocols import Bench, Camera, Frame
from workbench.model.errors import RigNotReadyError

T = TypeVar("T")
B = TypeVar("B", bound=Bench)
PATIENCE_S = 0.75
"""Longest wait for a frame, s; together with the end of the program less than two seconds."""
FIRST_PATIENCE_S = 5.0
"""Longest wait for the first frame, s, because cameras start slowly."""


@dataclass
class WatchedCamera:
    """Camera whose calls run in a separate thread; after a call without an answer it is abandoned.

    A call that hangs cannot be interrupted; its thread ends with the program.
    """

    camera: Camera
    _patience_s: float = FIRST_PATIENCE_S
    _asked: queue.SimpleQueue[Callable[[], object]] = field(default_factory=queue.SimpleQueue)
    _answers: queue.SimpleQueue[object] = field(default_factory=queue.SimpleQueue)
    _gone: bool = False

    def __post_init__(self) -> None:
        threading.Thread(target=self._serve, name="camera", daemon=True).start()

    def grab(self) -> Frame:
        """Frame of the camera, see `protocols.Camera`.

        Raises:
            RigNotReadyError: no first frame within `FIRST_PATIENCE_S`, or no later one within `PATIENCE_S`.
        """
        return self._ask(self.camera.grab)

    def grab_ambient(self) -> Frame:
        """Frame in room light, see `protocols.Camera`; raises the errors of `grab`."""
        return self._ask(self.camera.grab_ambient)

    def close(self) -> None:
        """Release the camera; one that hangs is released at the end of the program."""
        if not self._gone:
            self._ask(self.camera.close)

    def _ask(self, call: Callable[[], T]) -> T:
        if self._gone:  # a late answer would be taken for the answer to this call
            raise RigNotReadyError("camera: no answer to an earlier call; end this run and check its cable")
        self._asked.put(call)
        try:
            answer = self._answers.get(timeout=self._patience_s)
        except queue.Empty:
            self._gone = True
            raise RigNotReadyError(
                f"camera: expected an answer within {self._patience_s:g} s, got none;"
                " check its cable and whether another program holds it"
            ) from None
        if isinstance(answer, BaseException):
            raise answer
        self._patience_s = PATIENCE_S
        return answer  # type: ignore[return-value] # of the call that was put just before

    def _serve(self) -> None:
        while True:
            call = self._asked.get()
            try:
                self._answers.put(call())
            except BaseException as error:
                self._answers.put(error)


def watched(bench: B) -> B:
    """Bench with time limits on its camera's calls."""
    return replace(bench, camera=WatchedCamera(bench.camera))
