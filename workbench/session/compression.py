"""Notes on images that were compressed by JPEG, which moves spots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from workbench.model.captures import BOARD, CaptureRow
from workbench.model.number_text import counted

REMEDY = (
    "JPEG moves spots, by more than their stated deviations. Do: record uncompressed frames (pixel_format"
    " GREY or YUYV), and store them as PNG"
)


def compression_notes(rows: Sequence[CaptureRow]) -> list[str]:
    """At most one note on the images of spots: JPEG files, or blocks of JPEG in the first other image.

    Raises:
        BadInputError: that image cannot be read.
    """
    images = [row.on for row in rows if row.on is not None and row.laser_id != BOARD]
    if not images:
        return []
    from workbench.session.frames import JPEG, read_image  # OpenCV takes time to load
    from workbench.spots.jpeg_blocks import has_jpeg_blocks

    compressed = sum(_begins_with(path, JPEG) for path in dict.fromkeys(images))
    if compressed:
        return [f"{counted(compressed, 'image')} of spots compressed by JPEG. {REMEDY}."]
    if has_jpeg_blocks(read_image(images[0])):
        return [f"the images show the blocks of JPEG compression ({images[0].name}). {REMEDY}."]
    return []


def _begins_with(path: Path, content: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(content)) == content
