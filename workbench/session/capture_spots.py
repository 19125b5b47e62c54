"""Spots in the images of one row of a captures file."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.captures import CaptureRow
from workbench.model.errors import BadInputError
from workbench.session.frames import read_image
from workbench.spots import Finding, Scanline, find_spots


def find_row_spots(
    row: CaptureRow,
    size_px: tuple[int, int],
    scanlines: Sequence[Scanline],
    expected: int,
    speckle_sd_px: float,
) -> Finding:
    """Read the row's images and find the spots in them; arguments as of `SpotFinder`.

    Raises:
        BadInputError: an image is missing, truncated or of another size, or the pair does not match.
    """
    if row.on is None:
        raise ValueError(f"row {row.row} states a position, not images")
    try:
        on = read_image(row.on, size_px)
        off = None if row.off is None else read_image(row.off, size_px)
        return find_spots(on, off, scanlines=scanlines, expected=expected, speckle_sd_px=speckle_sd_px)
    except BadInputError as error:
        raise BadInputError(f"row {row.row}: {error}") from None
