"""Frame store of a session (lossless PNG, on disk before anything refers to it), and reader of images."""

from __future__ import annotations

import hashlib
import struct
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from glob import escape
from itertools import count
from pathlib import Path

import cv2
import numpy as np

from workbench.model.arrays import Image
from workbench.model.contents import not_text, read_file
from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import FrameRef
from workbench.session.files import sync_folder, write_record
from workbench.spots.grey import JPEG_MARGIN_DN, to_grey

PNG, JPEG = b"\x89PNG", b"\xff\xd8"
"""Beginnings of files."""
LARGEST_BYTES = 2**30
"""Largest image file: 16 bits a pixel for the largest cameras, not compressed, in three colours."""
_RECENT: deque[tuple[str, Image]] = deque(maxlen=16)
"""SHA-256 of the files of the last frames, and their images."""


@dataclass(frozen=True)
class FrameStore:
    """Folder `frames/` of one session."""

    session_dir: Path

    def save(self, key: str, which: str, image: Image, time_ns: int) -> FrameRef:
        """Store one frame and return a reference to it; the frame is on disk when this returns.

        Args:
            key: key of the capture; its slashes become folders.
            which: `on` or `off`.
            image: (height, width), uint8 or uint16.
            time_ns: wall clock time of the exposure.

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
            raise StoppedError(f"{path.parent}: cannot be created: {error.strerror}") from error
        write_record(path, content)
        sha256 = hashlib.sha256(content).hexdigest()
        _RECENT.append((sha256, image.copy()))  # a camera may reuse its buffer
        return FrameRef(path=str(relative), sha256=sha256, time_ns=time_ns)

    def bring_back(self, placement_key: str, frames: Sequence[FrameRef]) -> None:
        """Move the frames of a placement from `set-aside/` back, in exchange for the present ones.

        Frames that are in their place stay, so that a move that was interrupted can be repeated.

        Args:
            placement_key: key of the placement.
            frames: all frames of its captures.

        Raises:
            BadInputError: the frames are in no folder.
            StoppedError: the disk is full or cannot be written.
        """
        there = self.session_dir / "frames" / placement_key
        where = self.find_frames(placement_key, frames)
        if where == there:
            return
        self.set_aside(placement_key)
        try:
            there.parent.mkdir(parents=True, exist_ok=True)
            where.rename(there)
            sync_folder(there.parent)
            sync_folder(where.parent)
        except OSError as error:
            raise StoppedError(f"{where}: cannot be moved to {there}: {error.strerror}") from error

    def find_frames(self, placement_key: str, frames: Sequence[FrameRef]) -> Path:
        """Folder of a placement that has the frames: in `frames/`, or in `set-aside/`.

        Raises:
            BadInputError: no folder has all of them, unchanged.
        """
        usual = self.session_dir / "frames" / placement_key
        for folder in (usual, *sorted(self.session_dir.glob(f"set-aside/*/{escape(placement_key)}"))):
            moved = {folder / (self.session_dir / one.path).relative_to(usual): one.sha256 for one in frames}
            if all(path.is_file() and _sha256(path) == expected for path, expected in moved.items()):
                return folder
        raise BadInputError(
            f"{self.session_dir}: expected the frames of {placement_key} in frames/ or set-aside/, got no"
            " folder that has all of them unchanged; restore it from a copy"
        )

    def set_aside(self, placement_key: str) -> None:
        """Move the frames of a placement that will be captured again to `set-aside/<number>/`.

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
            sync_folder((aside / str(number) / placement_key).parent)
            sync_folder(there.parent)
        except OSError as error:
            raise StoppedError(f"{there}: cannot be moved aside: {error.strerror}") from error


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def recent_image(sha256: str) -> Image | None:
    """Image of one of the last frames that this process stored; None for any other.

    It spares the recording of a running session the decoding, a third of its processor time.
    """
    return next((image for stored, image in reversed(_RECENT.copy()) if stored == sha256), None)


def read_image(path: Path, size_px: tuple[int, int] | None = None) -> Image:
    """Read a grey image, (height, width), uint8 or uint16; colour is converted by `to_grey`.

    Args:
        path: file in any format that OpenCV reads.
        size_px: required (width, height).

    Raises:
        BadInputError: the file is missing, no image, truncated, of another size, or of more pixels than any
            camera has (`workbench/__init__.py`).
    """
    content = read_file(path, "an image", LARGEST_BYTES)
    _check_whole(path, content)
    if content.startswith(PNG):
        _check_png(path, content, size_px)
    # An orientation tag would rotate the image and move every spot: pixels are used as stored.
    flags = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except cv2.error as error:
        raise BadInputError(f"{path}: expected an image, OpenCV cannot decode it: {error.err}") from None
    if image is None:
        got = not_text(content) or "text"
        raise BadInputError(f"{path}: expected an image, OpenCV cannot decode it; got {got}, or truncated")
    if image.dtype not in (np.uint8, np.uint16):
        raise BadInputError(f"{path}: expected 8 or 16 bits per pixel, got {image.dtype}")
    _check_size(path, (image.shape[1], image.shape[0]), size_px)
    return to_grey(image, margin_dn=JPEG_MARGIN_DN if content.startswith(JPEG) else 0)


def _check_whole(path: Path, content: bytes) -> None:
    """Refuse a truncated file: decoders silently fill its missing part with grey."""
    if not content:
        raise BadInputError(f"{path}: expected an image, the file is empty")
    png, jpeg = content.startswith(PNG), content.startswith(JPEG)
    if (png and b"IEND" not in content[-16:]) or (jpeg and b"\xff\xd9" not in content[-1024:]):
        raise BadInputError(f"{path}: the image is truncated after {len(content)} bytes")


def _check_png(path: Path, content: bytes, size_px: tuple[int, int] | None) -> None:
    """Refuse a PNG of another size before it is decoded, and one with a part longer than the file.

    The decoder would take the memory for such a part, up to 2 GB.
    """
    _check_size(path, struct.unpack(">II", content[16:24].ljust(8, b"\0")), size_px)
    start = 8
    while start < len(content):
        (length,) = struct.unpack(">I", content[start : start + 4].ljust(4, b"\xff"))
        start += 12 + length
        if start > len(content):
            raise BadInputError(f"{path}: the image is damaged: one of its parts is longer than the file")


def _check_size(path: Path, found_px: tuple[int, int], size_px: tuple[int, int] | None) -> None:
    if size_px is not None and found_px != size_px:
        raise BadInputError(
            f"{path}: expected an image of {size_px[0]} x {size_px[1]} pixels, got {found_px[0]} x"
            f" {found_px[1]}; is it from another camera or mode?"
        )
