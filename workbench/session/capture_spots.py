"""Spots in the images of one row of a captures file."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model.captures import CaptureRow
from workbench.model.errors import BadInputError
from workbench.session.frames import read_image
from workbench.spots import Finding, Scanline, find_spots
from workbench.spots.frames import default_saturation_dn


def find_row_spots(
    row: CaptureRow,
    size_px: tuple[int, int],
    scanlines: Sequence[Scanline],
    expected: int,
    speckle_sd_px: float,
    bits: int | None = None,
) -> Finding:
    """Read the row's images and find the spots in them.

    Args:
        row: row with images.
        size_px: required (width, height).
        scanlines: as of `SpotFinder`.
        expected: as of `SpotFinder`.
        speckle_sd_px: as of `SpotFinder`.
        bits: depth of frames of uint16; None: not known.

    Raises:
        BadInputError: an image is missing, truncated or of another size, or the pair does not match.
    """
    if row.on is None:
        raise ValueError(f"row {row.row} states a position, not images")
    try:
        on = read_image(row.on, size_px)
        off = None if row.off is None else read_image(row.off, size_px)
        return find_spots(
            on,
            off,
            scanlines=scanlines,
            expected=expected,
            saturation_dn=default_saturation_dn(on, bits),
            speckle_sd_px=speckle_sd_px,
        )
    except BadInputError as error:
        raise BadInputError(f"row {row.row}: {error}") from None
