"""The frame store, and images of any origin."""

from __future__ import annotations

import hashlib
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from workbench.model.arrays import Image
from workbench.model.errors import BadInputError, StoppedError
from workbench.session.frames import FrameStore, read_image, recent_image


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_frames_are_lossless_and_their_hash_is_the_file_s(tmp_path: Path, dtype: type) -> None:
    noise = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (48, 64))
    image: Image = noise.astype(np.uint8) if dtype is np.uint8 else noise.astype(np.uint16)
    ref = FrameStore(tmp_path).save("p.1/500mm/L1/00", "on", image, 17)
    content = (tmp_path / ref.path).read_bytes()
    assert hashlib.sha256(content).hexdigest() == ref.sha256
    read = read_image(tmp_path / ref.path, (64, 48))
    assert read.dtype == dtype
    np.testing.assert_array_equal(read, image)


def test_frames_are_brought_back_in_exchange_for_the_present_ones(tmp_path: Path) -> None:
    store, key = FrameStore(tmp_path), "p.1/500mm"
    first = [store.save(f"{key}/L{n}/00", "on", np.full((4, 4), n, np.uint8), 0) for n in range(2)]
    store.set_aside(key)
    second = store.save(f"{key}/L0/00", "on", np.full((4, 4), 9, np.uint8), 0)
    store.bring_back(key, first)
    store.bring_back(key, first)
    assert [read_image(tmp_path / one.path)[0, 0] for one in first] == [0, 1]
    store.bring_back(key, [second])
    assert read_image(tmp_path / second.path)[0, 0] == 9


def test_changed_frames_are_not_brought_back(tmp_path: Path) -> None:
    store, key = FrameStore(tmp_path), "p.1/500mm"
    first = store.save(f"{key}/L1/00", "on", np.zeros((4, 4), np.uint8), 0)
    store.set_aside(key)
    path = next(tmp_path.glob("set-aside/**/*.png"))
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(BadInputError, match="set-aside"):
        store.bring_back(key, [first])


def test_a_full_disk_leaves_no_half_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("workbench.session.files.os.fsync", no_space)
    with pytest.raises(StoppedError, match=r"00-on\.png.*No space left"):
        FrameStore(tmp_path).save("p/00", "on", np.zeros((4, 4), np.uint8), 0)
    assert list((tmp_path / "frames/p").iterdir()) == []


def test_the_last_frames_are_known_by_the_hash_of_their_file(tmp_path: Path) -> None:
    store = FrameStore(tmp_path)
    image = np.arange(48, dtype=np.uint8).reshape(6, 8)
    refs = []
    for n in range(30):
        image += 1  # as of a camera that reuses its buffer
        refs.append((store.save(f"p/{n:02d}", "on", image, n), image.copy()))
    ref, stored = refs[-3]
    found = recent_image(ref.sha256)
    assert found is not None
    np.testing.assert_array_equal(found, stored)
    assert recent_image(refs[0][0].sha256) is None
    assert recent_image("") is None


def image_file(path: Path, extension: str = ".png") -> bytes:
    image = np.random.default_rng(0).integers(0, 256, (48, 64), dtype=np.uint8)
    content = cv2.imencode(extension, image)[1].tobytes()
    path.write_bytes(content)
    return content


@pytest.mark.parametrize("extension", [".png", ".jpg"])
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.95])
def test_a_truncated_image_is_named(tmp_path: Path, extension: str, part: float) -> None:
    path = tmp_path / f"a{extension}"
    content = image_file(path, extension)
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(BadInputError, match=str(path)):
        read_image(path)


def test_a_missing_image_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"no\.png: .*expected an image"):
        read_image(tmp_path / "no.png")


def test_something_else_than_an_image_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("laser_id,standoff_mm\n")
    with pytest.raises(BadInputError, match=r"a\.png: expected an image"):
        read_image(tmp_path / "a.png")


def test_an_image_of_another_size_is_named(tmp_path: Path) -> None:
    image_file(tmp_path / "a.png")
    with pytest.raises(BadInputError, match=r"a\.png: expected an image of 640 x 480 pixels, got 64 x 48"):
        read_image(tmp_path / "a.png", (640, 480))


def test_a_colour_image_becomes_grey(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), np.full((4, 5, 3), 90, np.uint8))
    assert read_image(path).tolist() == [[90] * 5] * 4


def test_frames_of_a_placement_are_set_aside_one_try_after_the_other(tmp_path: Path) -> None:
    store, image = FrameStore(tmp_path), np.zeros((4, 4), np.uint8)
    store.set_aside("p.1/500mm")
    assert not (tmp_path / "set-aside").exists()
    for _ in range(2):
        store.save("p.1/500mm/L1/00", "on", image, 0)
        store.save("p.1/600mm/L1/00", "on", image, 0)
        store.set_aside("p.1/500mm")
    aside = sorted(path.relative_to(tmp_path) for path in (tmp_path / "set-aside").rglob("*.png"))
    assert aside == [Path(f"set-aside/{n}/p.1/500mm/L1/00-on.png") for n in (1, 2)]
    assert [path.name for path in (tmp_path / "frames/p.1").iterdir()] == ["600mm"]


def test_an_image_of_32_bits_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tiff"
    cv2.imwrite(str(path), np.zeros((4, 4), np.float32))
    with pytest.raises(BadInputError, match="float32"):
        read_image(path)


def test_an_image_of_too_many_pixels_is_refused_before_it_is_decoded(tmp_path: Path) -> None:
    """30 000 x 30 000 pixels in a file of some bytes; decoding takes a gigabyte."""
    png = bytearray(cv2.imencode(".png", np.zeros((4, 4), np.uint8))[1].tobytes())
    png[16:24] = struct.pack(">II", 30_000, 30_000)
    png[29:33] = struct.pack(">I", zlib.crc32(png[12:29]))
    (tmp_path / "big.png").write_bytes(png)
    # OpenCV reads the limit when it is imported: here it may have been imported before the workbench.
    script = """
import sys
from pathlib import Path
from workbench.model.errors import BadInputError
from workbench.session.frames import read_image
try:
    read_image(Path(sys.argv[1]))
except BadInputError as error:
    print(error)
"""
    command = [sys.executable, "-c", script, str(tmp_path / "big.png")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "PIXELS" in done.stdout


@pytest.mark.parametrize("length", [0xEDA08000, 0x7FFFFFFF, 100_000])
def test_a_part_longer_than_the_file_is_refused_before_decoding(tmp_path: Path, length: int) -> None:
    """OpenCV would take as much memory."""
    content = image_file(tmp_path / "a.png")
    part = content.index(b"IDAT") - 4
    path = tmp_path / "b.png"
    path.write_bytes(content[:part] + struct.pack(">I", length) + content[part + 4 :])
    with pytest.raises(BadInputError, match=r"b\.png: the image is damaged"):
        read_image(path)


def test_the_size_of_a_png_is_read_before_its_pixels(tmp_path: Path) -> None:
    """The header alone states 30 000 x 30 000 pixels."""
    content = image_file(tmp_path / "a.png")
    path = tmp_path / "b.png"
    path.write_bytes(content[:16] + struct.pack(">II", 30_000, 30_000) + content[24:])
    with pytest.raises(BadInputError, match="expected an image of 64 x 48 pixels, got 30000 x 30000"):
        read_image(path, (64, 48))
