"""Public interface of the spot search: `SpotFinder` and `find_spots`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from workbench.model.arrays import Image
from workbench.model.errors import BadInputError
from workbench.spots.frames import check_pair, default_saturation_dn
from workbench.spots.strip import check_line
from workbench.spots.types import Finding, Scanline


class SpotFinder:
    """Spot search in frames of one size; prepares the strips of the scanlines once.

    Args:
        shape: Height and width of the frames.
        scanlines: Image lines that spots may lie on; none: the whole frame. Only their bands are read.
        expected: Number of lasers that are on.
        saturation_dn: Value of a clipped pixel; None means the full scale of the depth: 255 for uint8. For
            uint16 it is the 10, 12 or 14 bit full scale if the brightest pixel has exactly that value (left-
            or right-aligned), else 65535.
        speckle_sd_px: Deviation of a spot's centre by speckle, as the rig or the calibration states it. The
            contrast of speckle is measured in each frame, and averaged with it; 0: not known.
        reasons: Whether missing spots start a search for the reason, over the whole frame.

    Raises:
        BadInputError: a scanline without direction or width.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        scanlines: Sequence[Scanline] = (),
        *,
        expected: int | None = None,
        saturation_dn: int | None = None,
        speckle_sd_px: float = 0.0,
        reasons: bool = True,
    ) -> None:
        # Imported here, because numba takes half a second to load.
        from workbench.spots.search import Search

        for line in scanlines:
            check_line(line)
        self._shape = shape
        self._saturation_dn = saturation_dn
        self._search = Search(shape, tuple(scanlines), expected, speckle_sd_px, reasons)

    def find(self, on: Image, off: Image | None = None) -> Finding:
        """Spots of one capture.

        Raises:
            BadInputError: a frame is no grey uint8 or uint16 image, or has another size.
        """
        on, off = check_pair(on, off)
        if on.shape != self._shape:
            raise BadInputError(
                f"frame 'on': expected shape {self._shape}, got {on.shape}; make a SpotFinder for this size"
            )
        clip_dn = default_saturation_dn(on) if self._saturation_dn is None else self._saturation_dn
        return self._search.find(on, off, float(clip_dn))


def find_spots(
    on: Image,
    off: Image | None = None,
    *,
    scanlines: Sequence[Scanline] = (),
    expected: int | None = None,
    saturation_dn: int | None = None,
    speckle_sd_px: float = 0.0,
) -> Finding:
    """Find laser spots in a frame with the lasers on, or in its difference to one with the lasers off.

    For many frames of one size make one `SpotFinder` and call `find`. Arguments: see `SpotFinder`.

    Raises:
        BadInputError: a frame is no grey uint8 or uint16 image, or the two differ in size or depth; a
            scanline without direction or width.
    """
    shape: tuple[int, ...] = getattr(on, "shape", ())  # `find` reports a bad frame
    finder = SpotFinder(
        (shape[0], shape[1]) if len(shape) == 2 else (1, 1),
        scanlines,
        expected=expected,
        saturation_dn=saturation_dn,
        speckle_sd_px=speckle_sd_px,
    )
    return finder.find(on, off)


def is_compiled(folder: Path = Path(__file__).parent / "kernels") -> bool:
    """Whether the compiled loops are cached beside their sources; true where that folder is not writable."""
    return not os.access(folder, os.W_OK) or any((folder / "__pycache__").glob("*.nbi"))
