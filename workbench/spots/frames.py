"""Input checks of frames: shape, type and size; full scale of their depth."""

from __future__ import annotations

from typing import cast

import numpy as np

from workbench.model.arrays import Image
from workbench.model.errors import BadInputError

_DTYPES = (np.dtype(np.uint8), np.dtype(np.uint16))
_FULL_SCALES_IN_16_BITS = tuple(2**bits - 1 for bits in (10, 12, 14, 16))
_FULL_SCALES_LEFT_ALIGNED = tuple(2**16 - 2**free for free in range(1, 9))


def check_frame(frame: object, name: str) -> Image:
    """`frame` itself if it is a grey image of uint8 or uint16 with at least one pixel.

    Raises:
        BadInputError: it is not.
    """
    if isinstance(frame, np.ndarray) and frame.ndim == 2 and frame.dtype in _DTYPES and frame.size:
        return cast(Image, frame)
    expected = f"frame '{name}': expected a grey image (rows x columns, uint8 or uint16)"
    if not isinstance(frame, np.ndarray):
        raise BadInputError(f"{expected}, got {type(frame).__name__}; read the image with cv2.imread first")
    if frame.ndim != 2:
        remedy = "convert colour with cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), or store it grey"
        raise BadInputError(f"{expected}, got an array of shape {frame.shape}; {remedy}")
    if frame.dtype not in _DTYPES:
        raise BadInputError(f"{expected}, got dtype {frame.dtype}; store the camera's raw numbers unscaled")
    raise BadInputError(f"{expected}, got no pixel (shape {frame.shape}); check the file or the crop")


def check_pair(on: object, off: object | None) -> tuple[Image, Image | None]:
    """Both frames, checked for equal size and depth.

    Raises:
        BadInputError: a frame is no grey uint8 or uint16 image, or the two differ in size or depth.
    """
    on = check_frame(on, "on")
    if off is None:
        return on, None
    off = check_frame(off, "off")
    if off.shape != on.shape or off.dtype != on.dtype:
        raise BadInputError(
            f"frame 'off': expected the size and depth of 'on', {on.shape} {on.dtype}, got "
            f"{off.shape} {off.dtype}; "
            "take both frames with the same camera settings"
        )
    return on, off


def default_saturation_dn(on: Image, bits: int | None = None) -> int:
    """Value at which a pixel counts as clipped: the full scale of the depth.

    A camera of 10, 12 or 14 bits delivers uint16. Its values are left-aligned if all are multiples of 2^k and
    the brightest is 65536 - 2^k, the full scale then. Otherwise they are right-aligned.

    Args:
        on: frame.
        bits: depth of a right-aligned frame of uint16; None: that of the smallest full scale not below the
            brightest pixel.
    """
    if on.dtype == np.uint8:
        return 255
    brightest = int(on.max())
    if bits is not None and brightest < 1 << bits:
        return (1 << bits) - 1
    if brightest in _FULL_SCALES_LEFT_ALIGNED:
        step = 2**16 - brightest
        if int(np.bitwise_or.reduce(on, axis=None)) % step == 0:
            return brightest
    return next(full_scale for full_scale in _FULL_SCALES_IN_16_BITS if full_scale >= brightest)
