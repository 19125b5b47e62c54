"""A recording of a camera's own frames, two bytes a pixel: an AVI file in YUYV, which OpenCV cannot write."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def write_yuyv(path: Path, frames: Sequence[NDArray[np.uint8]]) -> None:
    """Write frames (height, width, 2) of uint8: luminance, and chroma U in even, V in odd columns."""
    height, width = frames[0].shape[:2]
    size = 2 * width * height
    rate = (1, 30)
    period_us, per_s = 1_000_000 // 30, 30 * size
    main = struct.pack("<14I", period_us, per_s, 0, 0, len(frames), 0, 1, size, width, height, 0, 0, 0, 0)
    stream = struct.pack("<4s4s3I6I4h", b"vids", b"YUY2", 0, 0, 0, *rate, 0, len(frames), size, 0, 0, 0, 0, 0)
    picture = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 16, b"YUY2", size, 0, 0, 0, 0)
    streams = _list(b"strl", _chunk(b"strh", stream) + _chunk(b"strf", picture))
    header = _list(b"hdrl", _chunk(b"avih", main) + streams)
    movie = _list(b"movi", b"".join(_chunk(b"00dc", frame.tobytes()) for frame in frames))
    path.write_bytes(_chunk(b"RIFF", b"AVI " + header + movie))


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _list(name: bytes, content: bytes) -> bytes:
    return _chunk(b"LIST", name + content)
