"""The camera driver `opencv`: a device, a network stream or a video file that OpenCV opens."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar

import cv2
import numpy as np
from pydantic import Field, model_validator

from workbench.devices.protocols import Frame
from workbench.model.arrays import Image
from workbench.model.device_block import DeviceBlock
from workbench.model.errors import RigNotReadyError
from workbench.model.exposure import WIDEST
from workbench.model.rig import CameraSpec, Name, PositiveFloat, Rig

SILENT_S = 1.5
"""Time without a frame after which a camera counts as unplugged, s: it is reported within two seconds."""
LOOK_S = 0.05
"""Time between two beats while a frame is awaited, s."""
BACKLOG = 32
"""Number of frames kept for a caller that reads them one by one."""
MANUAL_EXPOSURE = 1.0
"""Value of V4L2's `exposure_auto`."""
COARSEST_STEP = 2.0
"""Largest factor between a requested exposure and the one that the camera sets."""
SAME = 0.005
"""Relative difference below which a setting counts as set as requested."""


class OpenCvBlock(DeviceBlock):
    """The block `devices: camera:` of the rig file. Settings are in the camera's units, and are read back."""

    source: Name
    """Number of a device, its path, the URL of a stream, or a video file."""
    pixel_format: Annotated[str, Field(pattern=r"^[ -~]{4}$")] | None = None
    """Four letters, as YUYV or GREY."""
    exposure: float | None = None
    exposure_limits: tuple[PositiveFloat, PositiveFloat] | None = None
    """Shortest and longest to choose from at each placement, beginning with `exposure`; None: `exposure` is
    kept."""
    ambient_exposure: float | None = None
    """For frames of room light alone, as of the printed board; None: exposed as all others."""
    gain: float | None = None
    buffer_frames: Annotated[int, Field(ge=1)] | None = None
    latency_frames: Annotated[int, Field(ge=0)] = 2
    """Number of frames under way, or being exposed, when a laser is switched: they are discarded."""

    @model_validator(mode="after")
    def _has_an_exposure_to_go_back_to(self) -> OpenCvBlock:
        if self.ambient_exposure is not None and self.exposure is None:
            raise ValueError("ambient_exposure needs an exposure to go back to")
        return self

    @model_validator(mode="after")
    def _begins_within_its_limits(self) -> OpenCvBlock:
        if self.exposure_limits is not None:
            shortest, longest = self.exposure_limits
            if self.exposure is None or not shortest <= self.exposure <= longest or shortest == longest:
                raise ValueError(
                    "exposure_limits: expected [shortest, longest], with an exposure to begin with between"
                    f" them, got {list(self.exposure_limits)} and {self.exposure}"
                )
            if longest > WIDEST * shortest:
                raise ValueError(
                    f"exposure_limits: expected the longest to be at most {WIDEST:g} times the shortest, got"
                    f" {list(self.exposure_limits)}; no camera's spots differ by more"
                )
        return self


class OpenCvCamera:
    """See `protocols.StreamingCamera` and `protocols.ExposableCamera`.

    A thread of its own takes the frames as they come, so that none is older than necessary; from a file it
    takes one when the one before has been read.
    """

    settings_type: ClassVar = OpenCvBlock

    @classmethod
    def open(cls, settings: OpenCvBlock, rig: Rig, beat: Callable[[], None]) -> OpenCvCamera:
        """Open it, see `drivers.CameraDriver`; the errors of the constructor."""
        return cls(settings, rig.camera, beat)

    def __init__(
        self, device: OpenCvBlock, camera: CameraSpec, beat: Callable[[], None] = lambda: None
    ) -> None:
        """Open it, make its settings and check that they were taken, and look at a first frame.

        Args:
            device: what to open, and the settings.
            camera: the format that the frames must have.
            beat: called by `grab` and `read`, in the thread that calls these, at least every 0.1 s.

        Raises:
            RigNotReadyError: no such camera, it does not deliver, or a setting or the format is another.
        """
        self.discard_frames = device.latency_frames
        self._device, self._format, self._beat = device, camera, beat
        self._is_file = Path(device.source).is_file()
        self.exposure_limits, self.exposure_unit = device.exposure_limits, ""
        self._exposure = self._for_spots = device.exposure
        self._wish: float | None = None
        """An exposure to take as near as the camera can."""
        self._frames: deque[Frame] = deque(maxlen=BACKLOG)
        self._changed = threading.Condition()
        self._ended: str | None = None
        """Why no more frames come."""
        self._closing = False
        self._capture = _open(device, camera)
        self._thread = threading.Thread(target=self._take, name="camera", daemon=True)
        self._thread.start()
        try:
            self._check_format(self.read().image)
        except BaseException:
            self.close()
            raise

    def grab(self) -> Frame:
        """A frame whose exposure began after this call: what came before, and `discard_frames`, are dropped.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """
        with self._changed:
            if not self._is_file:
                self._frames.clear()
        for _ in range(self.discard_frames):
            self.read()
        return self.read()

    def grab_ambient(self) -> Frame:
        """As `grab`, with `ambient_exposure` where the rig file has one."""
        if self._device.ambient_exposure is None:
            return self.grab()
        self._exposure = self._device.ambient_exposure
        try:
            self.read()  # the frame under way when the setting is made
            return self.grab()
        finally:
            self._exposure = self._for_spots
            self.read()

    def set_exposure(self, exposure: float) -> float:
        """Expose so, as near as the camera can; returns the exposure that it says it has.

        Raises:
            RigNotReadyError: it is another, or the camera does not answer.
        """
        with self._changed:
            self._wish = exposure
            self._changed.wait_for(lambda: self._wish is None or self._ended is not None, SILENT_S)
            if self._ended is not None or self._wish is not None:
                raise RigNotReadyError(self._ended or self._silent(f"nothing for {SILENT_S:g} s"))
            came = self._for_spots
            self._frames.clear()
        if came is None or not exposure / COARSEST_STEP <= came <= exposure * COARSEST_STEP:
            raise RigNotReadyError(
                f"camera {self._device.source}: exposure: asked for {exposure:g}, the camera says {came};"
                " put limits into the rig file that it can keep, or leave exposure_limits out"
            )
        self.read()  # the frame under way when the setting is made
        return came

    def read(self) -> Frame:
        """The next frame of the stream, with the wall clock when it arrived.

        Raises:
            RigNotReadyError: the camera does not deliver.
        """
        deadline = time.monotonic() + SILENT_S
        self._beat()
        while True:
            with self._changed:
                if self._frames:
                    self._changed.notify_all()
                    return self._frames.popleft()
                if self._ended is not None:
                    raise RigNotReadyError(self._ended)
                if time.monotonic() >= deadline:
                    raise RigNotReadyError(self._silent(f"nothing for {SILENT_S:g} s"))
                self._changed.wait(LOOK_S)
            self._beat()

    def close(self) -> None:
        """Release the device. One that hangs in its driver is left to the end of the program."""
        self._closing = True
        with self._changed:
            self._changed.notify_all()
        self._thread.join(LOOK_S * 10)
        if not self._thread.is_alive():
            self._capture.release()

    def _take(self) -> None:
        """Frames, until the camera ends or is closed; only this thread touches the device."""
        made = self._exposure
        while not self._closing:
            try:
                if self._wish is not None:
                    made = self._grant(self._wish)
                if self._exposure != made:
                    made = self._exposure
                    _set(self._capture, self._device.source, cv2.CAP_PROP_EXPOSURE, "exposure", made)
                came, image = self._capture.read()
                frame = Frame(_grey(image, 2**self._format.bits - 1), time.time_ns()) if came else None
            except (RigNotReadyError, cv2.error) as error:
                self._end(str(error))
                return
            if frame is None:
                self._end(self._silent("the end of the file" if self._is_file else "the end of the stream"))
                return
            with self._changed:
                self._frames.append(frame)
                self._changed.notify_all()
                if self._is_file:
                    self._changed.wait_for(lambda: not self._frames or self._closing)

    def _grant(self, wish: float) -> float:
        self._capture.set(cv2.CAP_PROP_EXPOSURE, wish)
        came = self._capture.get(cv2.CAP_PROP_EXPOSURE)
        with self._changed:
            self._exposure = self._for_spots = came
            self._wish = None
            self._changed.notify_all()
        return came

    def _end(self, why: str) -> None:
        with self._changed:
            self._ended = why
            self._changed.notify_all()

    def _silent(self, came: str) -> str:
        return (
            f"camera {self._device.source}: expected a frame, got {came};"
            " check its cable, and whether another program holds it"
        )

    def _check_format(self, image: Image) -> None:
        asked = (self._format.height_px, self._format.width_px, "8" if self._format.bits == 8 else "16")
        came = (*image.shape, str(8 * image.dtype.itemsize))
        if asked != came:
            raise RigNotReadyError(
                f"camera {self._device.source}: expected frames of {asked[1]} x {asked[0]} px in {asked[2]}"
                f" bits, as in the rig file, got {came[1]} x {came[0]} in {came[2]}"
            )


def _open(device: OpenCvBlock, camera: CameraSpec) -> cv2.VideoCapture:
    source = device.source
    is_device = source.isdigit() or source.startswith("/dev/")
    if is_device:
        capture = cv2.VideoCapture(int(source) if source.isdigit() else source, cv2.CAP_ANY)
    else:
        patience_ms = int(SILENT_S * 1000)
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, patience_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, patience_ms]
        capture = cv2.VideoCapture(source, cv2.CAP_FFMPEG, limits)
    if not capture.isOpened():
        raise RigNotReadyError(
            f"camera {source}: expected a device, a stream or a video file, could not open it;"
            " check its cable, its address, and whether another program holds it"
        )
    try:
        _make_settings(capture, device, camera, is_device)
    except BaseException:
        capture.release()
        raise
    return capture


def _make_settings(
    capture: cv2.VideoCapture, device: OpenCvBlock, camera: CameraSpec, is_device: bool
) -> None:
    """Every setting is read back. The picture's size is asked of a device; streams and files have one."""
    fourcc = device.pixel_format
    automatic = MANUAL_EXPOSURE if device.exposure is not None else None
    settings: list[tuple[int, str, float | None]] = [
        (cv2.CAP_PROP_FOURCC, "pixel_format", cv2.VideoWriter.fourcc(*fourcc) if fourcc else None),
        (cv2.CAP_PROP_FRAME_WIDTH, "width_px", camera.width_px if is_device else None),
        (cv2.CAP_PROP_FRAME_HEIGHT, "height_px", camera.height_px if is_device else None),
        (cv2.CAP_PROP_CONVERT_RGB, "raw frames (bits above 8)", 0.0 if camera.bits > 8 else None),
        (cv2.CAP_PROP_BUFFERSIZE, "buffer_frames", device.buffer_frames),
        (cv2.CAP_PROP_AUTO_EXPOSURE, "manual exposure", automatic),
        (cv2.CAP_PROP_EXPOSURE, "exposure", device.exposure),
        (cv2.CAP_PROP_GAIN, "gain", device.gain),
    ]
    for number, name, value in settings:
        _set(capture, device.source, number, name, value)


def _set(capture: cv2.VideoCapture, source: str, number: int, name: str, value: float | None) -> None:
    """Make one setting, unless it is None, and read it back."""
    if value is None:
        return
    capture.set(number, value)
    came = capture.get(number)
    if abs(came - value) > SAME * abs(value):
        raise RigNotReadyError(
            f"camera {source}: {name}: asked for {value:g}, the camera says {came:g}; put a value into the"
            " rig file that it takes, or leave the setting out"
        )


def _grey(image: np.ndarray[Any, Any], full_scale: int) -> Image:
    """Of colours their weighted mean, which is linear in the light and sharper than any of them by itself.

    Where one of them is clipped it is not linear any more: such a pixel is given as clipped. (The mean of a
    red spot that was clipped long ago is at 30 % of full scale.)
    """
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[:, :, 0]
    grey: Image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=image.dtype)
    blue, green, red = cv2.split(image)[:3]
    grey[np.asarray(cv2.max(cv2.max(blue, green), red)) >= full_scale] = full_scale
    return grey
