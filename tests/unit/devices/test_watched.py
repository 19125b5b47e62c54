"""A camera that is not waited for longer than agreed."""

from __future__ import annotations

import threading

import pytest

from workbench.devices.protocols import Frame
from workbench.devices.watched import WatchedCamera
from workbench.model.errors import RigNotReadyError


def test_errors_of_the_camera_are_handed_on() -> None:
    class Camera:
        closed = False

        def grab(self) -> Frame:
            raise RigNotReadyError("dark")

        def grab_ambient(self) -> Frame:
            raise KeyError("a defect")

        def close(self) -> None:
            self.closed = True

    camera = Camera()
    watched = WatchedCamera(camera)
    with pytest.raises(RigNotReadyError, match="dark"):
        watched.grab()
    with pytest.raises(KeyError, match="defect"):
        watched.grab_ambient()
    watched.close()
    assert camera.closed


def test_a_camera_that_hangs_is_given_up_for_good() -> None:
    goes_on = threading.Event()

    class Camera:
        def grab(self) -> Frame:
            goes_on.wait(60)
            raise RigNotReadyError("late")

        grab_ambient = grab

        def close(self) -> None:
            pytest.fail("it would be waited for again")

    watched = WatchedCamera(Camera(), _patience_s=0.05)
    with pytest.raises(RigNotReadyError, match=r"0\.05 s"):
        watched.grab()
    goes_on.set()
    with pytest.raises(RigNotReadyError, match="earlier"):
        watched.grab()
    watched.close()
