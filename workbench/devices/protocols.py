"""What procedures and ranging need of a bench, whatever its drivers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, runtime_checkable

from workbench.model.arrays import Image
from workbench.model.prompt import Answer, Prompt
from workbench.model.target import Placement


@dataclass(frozen=True)
class Frame:
    """One grey frame, (height, width), uint8 or uint16, and the wall clock at its exposure, ns since 1970."""

    image: Image
    time_ns: int


class Camera(Protocol):
    """A grey camera."""

    def grab(self) -> Frame:
        """A frame whose exposure began after this call.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """

    def grab_ambient(self) -> Frame:
        """As `grab`, exposed for room light rather than for spots, which are some 1000 times brighter.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """

    def close(self) -> None:
        """Release the device."""


@runtime_checkable
class StreamingCamera(Camera, Protocol):
    """A camera whose stream can be read, so that its latency can be measured."""

    discard_frames: int
    """Number of frames that `grab` drops as too old."""

    def read(self) -> Frame:
        """The next frame of the stream, as old as it is.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """


@runtime_checkable
class ExposableCamera(Camera, Protocol):
    """A camera whose exposure can be set; its numbers are linear in it until they are clipped."""

    exposure_limits: tuple[float, float] | None
    """Shortest and longest that may be set; None where the rig file fixes the exposure."""
    exposure_unit: str
    """Empty for a driver's own."""

    def set_exposure(self, exposure: float) -> float:
        """Expose so from the next `grab` on; returns the exposure as the camera took it.

        Raises:
            RigNotReadyError: the camera does not take it.
        """


def settable(camera: Camera) -> tuple[ExposableCamera, tuple[float, float]] | None:
    """The camera and its exposure's limits, where the rig lets it be set."""
    if not isinstance(camera, ExposableCamera) or camera.exposure_limits is None:
        return None
    return camera, camera.exposure_limits


@dataclass(frozen=True)
class LaserState:
    """State of the lasers' outputs and of the interlock, as the device reports it."""

    lit: tuple[str, ...]
    """Ids of the lasers that are on."""
    interlock_closed: bool | None
    """None where the driver does not know."""


class LaserBank(Protocol):
    """The lasers. There is one way to switch one on, and it ends by itself."""

    ids: tuple[str, ...]
    identity: str
    """Name of the device that switches them, as it reports it."""

    def lit(self, ids: Sequence[str], for_s: float) -> AbstractContextManager[None]:
        """Hold the lasers `ids` lit inside the `with` block, for at most `for_s` seconds.

        Leaving the block switches every laser off and verifies it at the device.

        Raises:
            RigNotReadyError: the controller refuses or does not answer.
            LaserOffNotConfirmedError: the controller did not confirm that all are off.
        """

    def beat(self) -> None:
        """Renew the lease of what is on. To be called by the thread that does the work."""

    def all_off(self) -> None:
        """Switch every laser off and verify it; the errors of `lit`."""

    def state(self) -> LaserState:
        """What is on at this moment, and the interlock.

        Raises:
            RigNotReadyError: the device does not answer.
        """

    def close(self) -> None:
        """All off, then release the device."""


class Target(Protocol):
    """What places the target: a person, a rail, an emulated bench."""

    def place(self, placement: Placement) -> Placement:
        """Place the target; returns the placement as measured by the ruler."""


class Operator(Protocol):
    """Who answers a procedure's prompts."""

    def ask(self, prompt: Prompt) -> Answer:
        """Ask one question and wait for its answer, which fits (`Prompt.refuse`).

        Raises:
            AnswerNeededError: there is nobody to answer.
        """


@dataclass(frozen=True)
class Bench:
    """The devices of one rig, opened together and closed together."""

    camera: Camera
    lasers: LaserBank
    target: Target
    mark: Callable[[str], None] = lambda key: None
    """Called with the key of the capture about to be taken. An emulated bench keys its noise by it, so that a
    capture taken again after a stop is the same to the bit; a real bench has no use for it."""
    operator: Operator | None = None
    """Operator of an emulated bench, who does what prompts ask for; None: a person answers."""
    virtual: bool = False
    """Whether the beams are simulated."""

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Lasers off first, whatever the camera does."""
        try:
            self.lasers.close()
        finally:
            self.camera.close()
