"""Camera driver `opencv`: a device, a network stream or a video file that OpenCV opens."""

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
from workbench.model.name import Name
from workbench.model.rig import CameraSpec, PositiveFloat, Rig
from workbench.spots.grey import JPEG_MARGIN_DN, to_grey

SILENT_S = 1.5
"""Time without a frame after which a camera counts as unplugged, s; reported within two seconds."""
LOOK_S = 0.05
"""Interval of beats while waiting for a frame, s."""
BACKLOG = 32
"""Number of frames that are kept for a caller that reads them one by one."""
MANUAL_EXPOSURE = 1.0
"""Value of V4L2's `exposure_auto`."""
COARSEST_STEP = 2.0
"""Largest ratio between a requested exposure and the one that the camera sets."""
SAME = 0.005
"""Relative difference below which a setting counts as set as requested."""


class OpenCvBlock(DeviceBlock):
    """Block `devices: camera:` of the rig file. Settings are in the camera's units and are read back."""

    source: Name
    """Number or path of a device, URL of a stream, or a video file."""
    pixel_format: Annotated[str, Field(pattern=r"^[ -~]{4}$")] | None = None
    """Four letters, such as YUYV or GREY."""
    exposure: float | None = None
    exposure_limits: tuple[PositiveFloat, PositiveFloat] | None = None
    """Shortest and longest exposure of the search at each placement; None: `exposure` is kept."""
    ambient_exposure: float | None = None
    """Exposure for frames in room light, as of the printed board; None: the same as for spots."""
    gain: float | None = None
    buffer_frames: Annotated[int, Field(ge=1)] | None = None
    latency_frames: Annotated[int, Field(ge=0)] = 2
    """Number of frames in transfer or exposure when a laser is switched, which are discarded."""

    @model_validator(mode="after")
    def _has_an_exposure_for_spots(self) -> OpenCvBlock:
        if self.ambient_exposure is not None and self.exposure is None:
            raise ValueError("ambient_exposure: expected exposure to be set too, got none")
        return self

    @model_validator(mode="after")
    def _begins_within_its_limits(self) -> OpenCvBlock:
        if self.exposure_limits is not None:
            shortest, longest = self.exposure_limits
            if self.exposure is None or not shortest <= self.exposure <= longest or shortest == longest:
                raise ValueError(
                    "exposure_limits: expected [shortest, longest] with `exposure` between them, got"
                    f" {list(self.exposure_limits)} and {self.exposure}"
                )
            if longest > WIDEST * shortest:
                raise ValueError(
                    f"exposure_limits: expected the longest to be at most {WIDEST:g} times the shortest, got"
                    f" {list(self.exposure_limits)}"
                )
        return self


class OpenCvCamera:
    """Camera through OpenCV, see `protocols.StreamingCamera` and `protocols.ExposableCamera`.

    A separate thread reads frames as they arrive, so that none is older than necessary. It reads the next
    frame of a video file when the previous one has been taken.
    """

    settings_type: ClassVar = OpenCvBlock

    @classmethod
    def open(cls, settings: OpenCvBlock, rig: Rig, beat: Callable[[], None]) -> OpenCvCamera:
        """Open the camera, see `drivers.CameraDriver`; raises the errors of the constructor."""
        return cls(settings, rig.camera, beat)

    def __init__(
        self, device: OpenCvBlock, camera: CameraSpec, beat: Callable[[], None] = lambda: None
    ) -> None:
        """Open the camera, make and verify its settings, and check a first frame.

        Args:
            device: source and settings.
            camera: required format of frames.
            beat: called by `grab` and `read`, in their thread, at least every 0.1 s.

        Raises:
            RigNotReadyError: the camera is missing or delivers no frame, or a setting or the format differs.
        """
        self.discard_frames = device.latency_frames
        self._device, self._format, self._beat = device, camera, beat
        self._is_file = Path(device.source).is_file()
        is_compressed = device.pixel_format == "MJPG" or not _is_device(device.source)
        self._margin_dn = JPEG_MARGIN_DN if is_compressed else 0
        self.exposure_limits, self.exposure_unit = device.exposure_limits, ""
        self._exposure = self._for_spots = device.exposure
        self._wish: float | None = None
        """Requested exposure that the thread has not set yet."""
        self._frames: deque[Frame] = deque(maxlen=BACKLOG)
        self._changed = threading.Condition()
        self._ended: str | None = None
        """Reason why no more frames arrive; None while the camera delivers."""
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
        """Frame whose exposure began after this call; earlier frames and `discard_frames` are dropped.

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
        """Frame as from `grab`, with `ambient_exposure` if the rig file states one."""
        if self._device.ambient_exposure is None:
            return self.grab()
        self._exposure = self._device.ambient_exposure
        try:
            self.read()  # the frame in exposure during the change
            return self.grab()
        finally:
            self._exposure = self._for_spots
            self.read()

    def set_exposure(self, exposure: float) -> float:
        """Set the exposure as close as the camera can; returns the exposure that it reports.

        Raises:
            RigNotReadyError: the reported exposure differs too much, or the camera does not answer.
        """
        with self._changed:
            self._wish = exposure
            self._changed.wait_for(lambda: self._wish is None or self._ended is not None, SILENT_S)
            if self._ended is not None or self._wish is not None:
                raise RigNotReadyError(self._ended or self._silent(f"nothing for {SILENT_S:g} s"))
            reported = self._for_spots
            self._frames.clear()
        if reported is None or not exposure / COARSEST_STEP <= reported <= exposure * COARSEST_STEP:
            raise RigNotReadyError(
                f"camera {self._device.source}: exposure: requested {exposure:g}, the camera reports"
                f" {reported}; state exposure_limits in the rig file that it supports, or remove them"
            )
        self.read()  # the frame in exposure during the change
        return reported

    def read(self) -> Frame:
        """Next frame of the stream, with the wall clock time of its arrival.

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
        """Release the device; one that hangs in its driver is released at the end of the program."""
        self._closing = True
        with self._changed:
            self._changed.notify_all()
        self._thread.join(LOOK_S * 10)
        if not self._thread.is_alive():
            self._capture.release()

    def _take(self) -> None:
        """Read frames until the camera ends or is closed; only this thread uses the device."""
        made = self._exposure
        while not self._closing:
            try:
                if self._wish is not None:
                    made = self._grant(self._wish)
                if self._exposure != made:
                    made = self._exposure
                    _set(self._capture, self._device.source, cv2.CAP_PROP_EXPOSURE, "exposure", made)
                ok, image = self._capture.read()
                frame = Frame(self._grey(image), time.time_ns()) if ok else None
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

    def _grey(self, image: np.ndarray[Any, Any]) -> Image:
        return to_grey(image, 2**self._format.bits - 1, self._margin_dn)

    def _grant(self, wish: float) -> float:
        self._capture.set(cv2.CAP_PROP_EXPOSURE, wish)
        reported = self._capture.get(cv2.CAP_PROP_EXPOSURE)
        with self._changed:
            self._exposure = self._for_spots = reported
            self._wish = None
            self._changed.notify_all()
        return reported

    def _end(self, why: str) -> None:
        with self._changed:
            self._ended = why
            self._changed.notify_all()

    def _silent(self, got: str) -> str:
        return (
            f"camera {self._device.source}: expected a frame, got {got};"
            " check its cable and whether another program holds it"
        )

    def _check_format(self, image: Image) -> None:
        expected = (self._format.height_px, self._format.width_px, "8" if self._format.bits == 8 else "16")
        got = (*image.shape, str(8 * image.dtype.itemsize))
        if expected != got:
            raise RigNotReadyError(
                f"camera {self._device.source}: expected frames of {expected[1]} x {expected[0]} px with"
                f" {expected[2]} bits (rig file), got {got[1]} x {got[0]} px with {got[2]} bits; correct the"
                " rig file or the camera's settings"
            )


def _open(device: OpenCvBlock, camera: CameraSpec) -> cv2.VideoCapture:
    source = device.source
    is_device = _is_device(source)
    if is_device:
        capture = cv2.VideoCapture(int(source) if source.isdigit() else source, cv2.CAP_ANY)
    else:
        patience_ms = int(SILENT_S * 1000)
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, patience_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, patience_ms]
        capture = cv2.VideoCapture(source, cv2.CAP_FFMPEG, limits)
    if not capture.isOpened():
        raise RigNotReadyError(
            f"camera {source}: cannot be opened; expected a device, a stream or a video file;"
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
    """Make the settings and read each back. The image size is set only for devices."""
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
    if is_device:
        # Not read back: cameras without it refuse it. What adjusts itself is found by its effect.
        capture.set(cv2.CAP_PROP_AUTO_WB, 0.0)


def _set(capture: cv2.VideoCapture, source: str, number: int, name: str, value: float | None) -> None:
    """Make one setting, unless it is None, and verify it."""
    if value is None:
        return
    capture.set(number, value)
    reported = capture.get(number)
    if abs(reported - value) > SAME * abs(value):
        raise RigNotReadyError(
            f"camera {source}: {name}: requested {value:g}, the camera reports {reported:g}; state a"
            " supported value in the rig file, or remove the setting"
        )


def _is_device(source: str) -> bool:
    return source.isdigit() or source.startswith("/dev/")
