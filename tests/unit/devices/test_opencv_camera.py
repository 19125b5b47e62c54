"""The camera driver on a real stream over a socket, on a real file, and on a device that takes liberties."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, cast

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.fake_lasers import FakeLasers
from tests.support.mjpeg import Picture, Stream
from tests.support.yuyv import write_yuyv
from workbench.devices.opencv_camera import BACKLOG, OpenCvBlock, OpenCvCamera
from workbench.devices.placed_by_hand import PlacedByHand
from workbench.devices.protocols import Bench, Frame, StreamingCamera
from workbench.model.arrays import Image
from workbench.model.errors import RigNotReadyError
from workbench.model.prior import exactly
from workbench.model.rig import CameraSpec, Rig
from workbench.procedure.capture.exposure import set_exposure

WIDTH, HEIGHT = 160, 120
FORMAT = CameraSpec(
    width_px=WIDTH, height_px=HEIGHT, f_px=exactly(200.0), cx_px=exactly(79.5), cy_px=exactly(59.5)
)
LASER = {"id": "L1", "axis": "u", "x_mm": {"value": 60.0, "sd": 0}, "y_mm": {"value": 0.0, "sd": 0}}
RIG = Rig.model_validate({"format": 1, "rig": "red", "camera": FORMAT, "lasers": [LASER]})
UNPLUGGED_S = 2.0


def flat(level: int) -> Picture:
    return np.full((HEIGHT, WIDTH), level, np.uint8)


class Scene:
    """What the camera looks at."""

    level = 40

    def picture(self) -> Picture:
        return flat(self.level)


@pytest.fixture
def streams() -> Iterator[Callable[..., Stream]]:
    opened: list[Stream] = []

    def open_stream(picture: Callable[[], Picture], latency: int = 0) -> Stream:
        opened.append(Stream(picture, latency))
        return opened[-1]

    yield open_stream
    for stream in opened:
        stream.close()


def camera_of(source: str, **settings: float | str | tuple[float, float]) -> OpenCvCamera:
    return OpenCvCamera(OpenCvBlock.model_validate({"source": source, **settings}), FORMAT)


def level(image: Image) -> float:
    return float(np.median(image))


@pytest.mark.parametrize("latency", [0, 3, 6])
def test_a_grab_shows_what_was_switched_before_it(streams: Callable[..., Stream], latency: int) -> None:
    """Ten times, the scene changes and the next grab has to show it, however many frames are under way."""
    scene = Scene()
    # Besides those on their way: the one that was being exposed, the one that was on the line, and what a
    # busy computer leaves there for a tenth of a second.
    camera = camera_of(streams(scene.picture, latency).url, latency_frames=latency + 2 + 3)
    for number in range(10):
        scene.level = 40 + 20 * number
        assert level(camera.grab().image) == pytest.approx(scene.level, abs=2)
    camera.close()


def test_with_too_small_a_latency_a_grab_is_stale(streams: Callable[..., Stream]) -> None:
    """The test before can fail: without the discarded frames the old scene is seen."""
    scene = Scene()
    camera = camera_of(streams(scene.picture, 6).url, latency_frames=0)
    camera.grab()
    scene.level = 200
    assert level(camera.grab().image) == pytest.approx(40, abs=2)
    camera.close()


def test_read_gives_every_frame_in_turn_however_slow_the_reader(streams: Callable[..., Stream]) -> None:
    """Otherwise the latency would be counted in frames that nobody saw."""
    numbers = iter(range(10_000))
    camera = camera_of(streams(lambda: flat(8 * (next(numbers) % 32))).url)
    assert isinstance(camera, StreamingCamera)
    camera.grab()
    seen = []
    for _ in range(8):
        seen.append(level(camera.read().image))
        time.sleep(0.07)  # two frames
    steps = {round(b - a) for a, b in pairwise(seen)}
    assert all(step == pytest.approx(8, abs=3) or step < -200 for step in steps)
    camera.close()


def test_frames_are_grey_and_stamped_when_they_arrive(streams: Callable[..., Stream]) -> None:
    camera = camera_of(streams(Scene().picture).url)
    before_ns = time.time_ns()
    first, second = camera.grab(), camera.grab()
    assert first.image.shape == (HEIGHT, WIDTH)
    assert first.image.dtype == np.uint8
    assert before_ns <= first.time_ns < second.time_ns <= time.time_ns()
    camera.close()


def test_it_beats_while_it_waits(streams: Callable[..., Stream]) -> None:
    beats: list[float] = []
    stream = streams(Scene().picture)
    camera = OpenCvCamera(OpenCvBlock(source=stream.url), FORMAT, lambda: beats.append(time.monotonic()))
    stream.goes_on.clear()
    time.sleep(0.2)
    beats.clear()
    with pytest.raises(RigNotReadyError):
        camera.grab()
    assert len(beats) > 10  # 1.5 s in steps of 0.05 s, on a busy computer
    camera.close()


def keep_grabbing(camera: OpenCvCamera) -> None:
    for _ in range(100):
        camera.grab()


@pytest.mark.real_time
@pytest.mark.parametrize("how", ["falls silent", "closes"])
def test_a_camera_that_is_unplugged(streams: Callable[..., Stream], how: str) -> None:
    stream = streams(Scene().picture)
    camera = camera_of(stream.url)
    camera.grab()
    if how == "closes":
        stream.unplugged = True
    else:
        stream.goes_on.clear()
    began = time.monotonic()
    with pytest.raises(RigNotReadyError, match=r"stream.mjpg: expected a frame, got .*; check its cable"):
        keep_grabbing(camera)
    took_s = time.monotonic() - began
    print(f"{how}: told after {took_s:.2f} s")
    assert took_s < UNPLUGGED_S
    began = time.monotonic()
    camera.close()
    assert time.monotonic() - began < UNPLUGGED_S


@pytest.mark.parametrize("source", ["/dev/video97", "97", "http://127.0.0.1:9/none.mjpg", "none.avi"])
def test_no_such_camera(source: str) -> None:
    with pytest.raises(RigNotReadyError, match=f"camera {source}: "):
        camera_of(source)


def test_frames_of_another_size(streams: Callable[..., Stream]) -> None:
    stream = streams(lambda: np.zeros((48, 64), np.uint8))
    with pytest.raises(RigNotReadyError, match=r"160 x 120 .*8.*64 x 48 .*8"):
        camera_of(stream.url)


def test_a_stream_has_no_exposure_to_set(streams: Callable[..., Stream]) -> None:
    with pytest.raises(RigNotReadyError, match=r"manual exposure: .*1\b.* -1\b"):
        camera_of(streams(Scene().picture).url, exposure=20)


def test_a_file_gives_its_frames_one_by_one_and_ends(tmp_path: Path) -> None:
    path = tmp_path / "recorded.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (WIDTH, HEIGHT))
    for number in range(12):
        writer.write(cv2.cvtColor(flat(20 * number), cv2.COLOR_GRAY2BGR))
    writer.release()
    camera = camera_of(str(path), latency_frames=0)  # the first frame was looked at when it was opened
    for number in range(1, 12):
        assert level(camera.grab().image) == pytest.approx(20 * number, abs=3)
    with pytest.raises(RigNotReadyError, match="the end of the file"):
        camera.grab()
    camera.close()


def test_a_file_waits_for_its_reader(tmp_path: Path) -> None:
    """More frames than are kept of a live camera; the reader begins when all could have been decoded."""
    path, count = tmp_path / "recorded.avi", 3 * BACKLOG
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (WIDTH, HEIGHT))
    for number in range(count):
        writer.write(cv2.cvtColor(flat(2 * number), cv2.COLOR_GRAY2BGR))
    writer.release()
    camera, again = camera_of(str(path)), cv2.VideoCapture(str(path))
    while again.read()[0]:
        pass
    again.release()
    found = [level(camera.read().image) for _ in range(count - 1)]
    camera.close()
    assert found == pytest.approx([2 * number for number in range(1, count)], abs=3)


def test_yuyv_of_any_colour_becomes_grey(tmp_path: Path) -> None:
    """Frames as V4L2 delivers them, two bytes a pixel: luminance from 16 to 235, and half the chroma."""
    frames = []
    for luminance in (16, 126, 235):
        frame = np.full((HEIGHT, WIDTH, 2), 128, np.uint8)
        frame[:, :, 0] = luminance
        frames += [frame, frame]
    write_yuyv(tmp_path / "recorded.avi", frames)
    camera = camera_of(str(tmp_path / "recorded.avi"), latency_frames=0)
    seen = [camera.read().image for _ in range(5)]
    camera.close()
    assert [image.dtype for image in seen] == 5 * [np.uint8]
    assert [level(image) for image in seen] == pytest.approx([0, 128, 128, 255, 255], abs=2)


def test_a_red_spot_of_an_mjpeg_stream_in_colour_is_clipped(streams: Callable[..., Stream]) -> None:
    def picture() -> Picture:
        image = np.full((HEIGHT, WIDTH, 3), 40, np.uint8)
        image[48:64, 96:112] = (40, 40, 255)
        return image

    camera = camera_of(streams(picture).url)
    image = camera.grab().image
    camera.close()
    assert image.shape == (HEIGHT, WIDTH)
    assert image[52:60, 100:108].min() > 250
    assert level(image[:32]) == pytest.approx(40, abs=2)


class Device:
    """Stands for a V4L2 device, which no computer without one can open: takes exposures in steps of 8."""

    def __init__(self, *args: object) -> None:
        self.settings: dict[int, float] = {}

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        return True

    def set(self, number: int, value: float) -> bool:
        self.settings[number] = 8 * round(value / 8) if number == cv2.CAP_PROP_EXPOSURE else value
        return True

    def get(self, number: int) -> float:
        return self.settings.get(number, 0.0)

    def read(self) -> tuple[bool, Picture]:
        time.sleep(0.005)
        return True, flat(int(self.settings[cv2.CAP_PROP_EXPOSURE]))

    def release(self) -> None:
        pass


def test_settings_are_made_and_read_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Device)
    camera = camera_of("/dev/video0", exposure=16, gain=3, pixel_format="GREY", buffer_frames=1)
    made = cast(Device, camera._capture).settings
    assert made == {
        cv2.CAP_PROP_FOURCC: cv2.VideoWriter.fourcc(*"GREY"),
        cv2.CAP_PROP_FRAME_WIDTH: WIDTH,
        cv2.CAP_PROP_FRAME_HEIGHT: HEIGHT,
        cv2.CAP_PROP_BUFFERSIZE: 1,
        cv2.CAP_PROP_AUTO_EXPOSURE: 1,
        cv2.CAP_PROP_EXPOSURE: 16,
        cv2.CAP_PROP_GAIN: 3,
        cv2.CAP_PROP_AUTO_WB: 0,
    }
    camera.close()


def test_a_setting_that_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Device)
    with pytest.raises(RigNotReadyError, match=r"exposure: .*20\b.* 16\b"):
        camera_of("/dev/video0", exposure=20)


def test_room_light_has_an_exposure_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Device)
    camera = camera_of("/dev/video0", exposure=16, ambient_exposure=160)
    assert level(camera.grab().image) == 16
    assert level(camera.grab_ambient().image) == 160
    assert level(camera.grab().image) == 16
    camera.close()


def test_an_ambient_exposure_needs_one_to_go_back_to() -> None:
    with pytest.raises(ValidationError, match="ambient_exposure"):
        OpenCvBlock(source="0", ambient_exposure=5.0)


def test_an_exposure_is_set_as_near_as_the_camera_can(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Device)
    camera = camera_of("/dev/video0", exposure=16, exposure_limits=(8, 240), ambient_exposure=160)
    assert camera.exposure_limits == (8, 240)
    assert camera.set_exposure(70.0) == 72
    assert level(camera.grab().image) == 72
    assert level(camera.grab_ambient().image) == 160
    assert level(camera.grab().image) == 72, "not what it began with"
    with pytest.raises(RigNotReadyError, match=r"exposure: .*3\b.* 0\b.*exposure_limits"):
        camera.set_exposure(3.0)
    camera.close()


class Colours(Device):
    """A red spot on a sensor of colours: each pixel's red is clipped by itself."""

    rate = 0.03
    """Red's share of full scale, for each unit of exposure."""
    lasers = FakeLasers()

    def read(self) -> tuple[bool, Picture]:
        time.sleep(0.001)
        red = min(0.05 + Colours.rate * self.settings[cv2.CAP_PROP_EXPOSURE] * Colours.lasers.is_lit, 1.0)
        shown = np.full((HEIGHT, WIDTH, 3), 12, np.uint8)
        shown[59:62, 99:102] = (15, 25, round(255 * red))
        return True, shown


@pytest.mark.parametrize("rate", [0.3, 0.01, 0.003])
def test_a_red_spot_on_a_camera_of_colours_is_not_clipped(
    monkeypatch: pytest.MonkeyPatch, rate: float
) -> None:
    """The weighted mean of its colours never gets brighter than 35 %: the search would go to 0.7 s."""
    monkeypatch.setattr(cv2, "VideoCapture", Colours)
    monkeypatch.setattr(Colours, "rate", rate)
    camera = camera_of("/dev/video0", exposure=16, exposure_limits=(8, 7000), latency_frames=1)
    found = set_exposure(Bench(camera, Colours.lasers, PlacedByHand()), RIG, "k", lambda key: None)
    camera.close()
    assert found is not None
    assert found.exposure == camera._for_spots
    red = 0.05 + rate * found.exposure
    if rate == 0.3:
        assert found.verdict == "clipped", "already at the shortest exposure"
        assert found.exposure == 8
    else:
        assert found.verdict == "dim", "of full scale, which a red spot reaches only by being clipped"
        assert 0.5 < red <= 0.75, "a quarter is left"


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (10, np.uint16), (12, np.uint16), (16, np.uint16)])
def test_a_pixel_that_is_clipped_in_one_colour_is_clipped(
    monkeypatch: pytest.MonkeyPatch, bits: int, kind: type[np.unsignedinteger[Any]]
) -> None:
    """At the camera's full scale, which need not be that of the numbers that carry it."""
    full = 2**bits - 1

    class Red(Device):
        def read(self) -> tuple[bool, Picture]:
            shown = np.full((HEIGHT, WIDTH, 3), 20, kind)
            shown[40, 60:62] = ((20, 20, full - 1), (20, 20, full))
            return True, cast(Picture, shown)

    monkeypatch.setattr(cv2, "VideoCapture", Red)
    camera = OpenCvCamera(
        OpenCvBlock(source="/dev/video0", exposure=16), FORMAT.model_copy(update={"bits": bits})
    )
    image = camera.grab().image
    camera.close()
    assert image[40, 59:63].tolist() == [20, round(0.299 * (full - 1) + 0.701 * 20), full, 20]


def test_an_exposure_that_is_another_the_next_time() -> None:
    """The last trial was none to keep, and what an earlier one told does not hold for what it has now."""

    class Forgetful:
        exposure_limits, exposure_unit = (10.0, 1000.0), ""
        asked: ClassVar[list[float]] = []
        keeps = True

        def set_exposure(self, exposure: float) -> float:
            again = exposure in self.asked
            self.asked.append(exposure)
            return exposure if self.keeps or not again else 0.9 * exposure

        def grab(self) -> Frame:
            picture = flat(12)
            picture[60, 100] = min(12 + int(1.5 * self.asked[-1] * Colours.lasers.is_lit), 255)
            return Frame(picture, 0)

        grab_ambient = grab

        def close(self) -> None:
            pass

    camera = Forgetful()
    bench = Bench(camera, Colours.lasers, PlacedByHand())
    found = set_exposure(bench, RIG, "k", lambda key: None)
    assert found is not None
    assert camera.asked[-1] in camera.asked[:-1], "half of it confirmed it, then it was set again"
    camera.asked.clear()
    camera.keeps = False
    with pytest.raises(RigNotReadyError, match=r"exposure: expected 100\b.* got 90\b"):
        set_exposure(bench, RIG, "k", lambda key: None)


def test_without_limits_the_exposure_is_fixed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Device)
    camera = camera_of("/dev/video0", exposure=16)
    assert camera.exposure_limits is None
    camera.close()


@pytest.mark.parametrize(
    ("exposure", "limits"), [(None, (1, 9)), (10, (1, 9)), (5, (9, 1)), (5, (5, 5)), (5, (1, 2e7))]
)
def test_limits_that_make_no_sense(exposure: float | None, limits: tuple[float, float]) -> None:
    with pytest.raises(ValidationError, match="exposure_limits: expected"):
        OpenCvBlock(source="0", exposure=exposure, exposure_limits=limits)


def test_a_camera_that_ends_while_its_exposure_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    class Unplugged(Device):
        def read(self) -> tuple[bool, Picture]:
            if self.settings[cv2.CAP_PROP_EXPOSURE] != 16:
                return False, flat(0)
            return super().read()

    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    camera = camera_of("/dev/video0", exposure=16, exposure_limits=(8, 240))
    with pytest.raises(RigNotReadyError, match="expected a frame, got the end of the stream"):
        camera.set_exposure(64.0)
    camera.close()
