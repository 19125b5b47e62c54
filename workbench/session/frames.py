"""The frame store: lossless PNG, on disk before anything refers to it; and reading anybody's images."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import cv2
import numpy as np

from workbench.model.arrays import Image
from workbench.model.contents import not_text
from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import FrameRef
from workbench.session.files import sync_folder, write_record


@dataclass(frozen=True)
class FrameStore:
    """The `frames/` folder of one session."""

    session_dir: Path

    def save(self, key: str, which: str, image: Image, time_ns: int) -> FrameRef:
        """Store one frame and return how to find it; it is on disk when this returns.

        Args:
            key: the capture's key; its slashes become folders.
            which: `on` or `off`.
            image: (height, width), uint8 or uint16.
            time_ns: wall clock at exposure.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        ok, png = cv2.imencode(".png", image)
        if not ok:
            raise ValueError(f"cannot encode an image of shape {image.shape} and type {image.dtype}")
        content = png.tobytes()
        relative = Path("frames") / f"{key}-{which}.png"
        path = self.session_dir / relative
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoppedError(f"{path.parent}: cannot be made: {error.strerror}") from error
        write_record(path, content)
        return FrameRef(path=str(relative), sha256=hashlib.sha256(content).hexdigest(), time_ns=time_ns)

    def set_aside(self, placement_key: str) -> None:
        """Move the frames of a placement that is about to be captured again into `set-aside/<number>/`.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        there = self.session_dir / "frames" / placement_key
        if not there.exists():
            return
        aside = self.session_dir / "set-aside"
        number = next(n for n in count(1) if not (aside / str(n)).exists())
        try:
            (aside / str(number) / placement_key).parent.mkdir(parents=True)
            there.rename(aside / str(number) / placement_key)
            sync_folder(there.parent)
        except OSError as error:
            raise StoppedError(f"{there}: cannot be moved aside: {error.strerror}") from error


def read_image(path: Path, size_px: tuple[int, int] | None = None) -> Image:
    """A grey image, (height, width), uint8 or uint16; colour is converted to grey.

    Args:
        path: any format that OpenCV reads.
        size_px: (width, height) that it must have.

    Raises:
        BadInputError: missing, not an image, truncated, or of another size.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInputError(f"{path}: expected an image: {error.strerror}") from None
    _check_whole(path, content)
    # A camera's idea of which side is up would move every spot: pixels are taken as they are stored.
    how = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), how)
    except cv2.error as error:
        raise BadInputError(f"{path}: expected an image, OpenCV refuses it: {error.err}") from None
    if image is None:
        came = not_text(content) or "text"
        raise BadInputError(f"{path}: expected an image, OpenCV cannot decode it; it is {came}, or truncated")
    if image.dtype not in (np.uint8, np.uint16):
        raise BadInputError(f"{path}: expected 8 or 16 bits a pixel, got {image.dtype}")
    if size_px is not None and (image.shape[1], image.shape[0]) != size_px:
        raise BadInputError(
            f"{path}: expected an image of {size_px[0]} x {size_px[1]} pixels,"
            f" got {image.shape[1]} x {image.shape[0]}; is it from another camera or mode?"
        )
    return (
        image.astype(np.uint8, copy=False) if image.dtype == np.uint8 else image.astype(np.uint16, copy=False)
    )


def _check_whole(path: Path, content: bytes) -> None:
    """Decoders fill what is missing of a truncated file with grey: look for the end ourselves."""
    if not content:
        raise BadInputError(f"{path}: expected an image, the file is empty")
    png, jpeg = content.startswith(b"\x89PNG"), content.startswith(b"\xff\xd8")
    if (png and b"IEND" not in content[-16:]) or (jpeg and b"\xff\xd9" not in content[-1024:]):
        raise BadInputError(f"{path}: the image is truncated: its end is missing after {len(content)} bytes")
