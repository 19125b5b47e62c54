"""Protocols of a bench for procedures and ranging, independent of drivers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol, runtime_checkable

from workbench.model.arrays import Image
from workbench.model.prompt import Answer, Prompt
from workbench.model.target import Placement


@dataclass(frozen=True)
class Frame:
    """Grey frame, (height, width), uint8 or uint16, with the wall clock time of exposure, ns since 1970."""

    image: Image
    time_ns: int


class Camera(Protocol):
    """Grey camera."""

    def grab(self) -> Frame:
        """Frame whose exposure began after this call.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """

    def grab_ambient(self) -> Frame:
        """Frame as from `grab`, exposed for room light instead of spots, which are 1000 times brighter.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """

    def close(self) -> None:
        """Release the device."""


@runtime_checkable
class StreamingCamera(Camera, Protocol):
    """Camera whose stream can be read, so that its latency can be measured."""

    discard_frames: int
    """Number of frames that `grab` drops as stale."""

    def read(self) -> Frame:
        """Next frame of the stream, which may be stale.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """


@runtime_checkable
class ExposableCamera(Camera, Protocol):
    """Camera whose exposure can be set; pixel values are linear in it until they are clipped."""

    exposure_limits: tuple[float, float] | None
    """Shortest and longest exposure; None if the rig file fixes the exposure."""
    exposure_unit: str
    """Unit of exposures; empty: the driver's own."""

    def set_exposure(self, exposure: float) -> float:
        """Set the exposure from the next `grab` on; returns the exposure that the camera accepted.

        Raises:
            RigNotReadyError: the camera does not accept the exposure.
        """


def settable(camera: Camera) -> tuple[ExposableCamera, tuple[float, float]] | None:
    """Camera and limits of its exposure; None if the exposure cannot or must not be set."""
    if not isinstance(camera, ExposableCamera) or camera.exposure_limits is None:
        return None
    return camera, camera.exposure_limits


@dataclass(frozen=True)
class LaserState:
    """State of the lasers' outputs and of the interlock, as the device reports it."""

    lit: tuple[str, ...]
    """Ids of the lasers that are on."""
    interlock_closed: bool | None
    """Whether the interlock is closed; None if the driver does not report it."""


class LaserBank(Protocol):
    """Lasers of a rig. The only way to switch lasers on is a context that ends by itself."""

    ids: tuple[str, ...]
    identity: str
    """Name of the switching device, as it reports it."""

    def lit(self, ids: Sequence[str], for_s: float) -> AbstractContextManager[None]:
        """Hold the lasers `ids` on inside the `with` block, for at most `for_s` seconds.

        Leaving the block switches every laser off and verifies it at the device.

        Raises:
            LeaseEndedError: the block took longer than `for_s`, so that the lasers were off at its end.
            RigNotReadyError: the controller refuses or does not answer.
            LaserOffNotConfirmedError: the controller did not confirm that all lasers are off.
        """

    def beat(self) -> None:
        """Renew the lease; must be called by the thread that uses the lasers."""

    def all_off(self) -> None:
        """Switch every laser off and verify it; raises the errors of `lit`."""

    def state(self) -> LaserState:
        """Present state of lasers and interlock.

        Raises:
            RigNotReadyError: the device does not answer.
        """

    def close(self) -> None:
        """Switch all lasers off, then release the device."""


class Target(Protocol):
    """Positioning of the target: by a person, a rail, or an emulated bench."""

    def place(self, placement: Placement) -> Placement:
        """Place the target; returns the placement as measured by the ruler.

        With `head_deg` also turn the scanning head; the result has the reading of its encoder.
        """


class Operator(Protocol):
    """Operator of the bench, who answers prompts."""

    def ask(self, prompt: Prompt) -> Answer:
        """Show a prompt and wait for a valid answer (`Prompt.refuse`).

        Raises:
            AnswerNeededError: there is no answer.
        """


class Clock(Protocol):
    """Time of a bench, in which its sensor drifts."""

    def now_ns(self) -> int:
        """Present time, ns."""

    def continue_after(self, time_ns: int) -> None:
        """Continue after the last capture that counts; called before the captures of each placement.

        Simulated time is set: the captures after a stop have the times that they would have had without it.
        A real clock ignores it.
        """


class WallClock:
    """Clock of the computer: UTC, ns since 1970."""

    def now_ns(self) -> int:
        """Present time."""
        return time.time_ns()

    def continue_after(self, time_ns: int) -> None:
        """Return at once: real time cannot be set."""


@dataclass(frozen=True)
class Bench:
    """Devices of one rig, opened and closed together."""

    camera: Camera
    lasers: LaserBank
    target: Target
    mark: Callable[[str], None] = lambda key: None
    """Called with the key of the next capture. An emulated bench derives its noise from the key, so that a
    capture taken again after a stop is identical; a real bench ignores it."""
    operator: Operator | None = None
    """Operator of an emulated bench, which answers prompts itself; None: a person answers."""
    virtual: bool = False
    """Whether the beams are simulated."""
    clock: Clock = field(default_factory=WallClock)
    """Time of the captures, by which a drift is fitted."""
    rests: bool = False
    """Whether nothing changes while the bench is closed, so that a resumed session continues the same part.
    A real sensor may cool or be moved."""

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the lasers first, then the camera, even after an error."""
        try:
            self.lasers.close()
        finally:
            self.camera.close()
