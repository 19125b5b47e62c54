"""Grey frame of a colour image."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from workbench.model.arrays import Image
from workbench.spots.frames import default_saturation_dn

JPEG_MARGIN_DN = 5
"""Most that a clipped colour lies below full scale after compression by JPEG, which mixes the colours."""


def to_grey(image: np.ndarray[Any, Any], full_scale_dn: int | None = None, margin_dn: int = 0) -> Image:
    """Grey image: the weighted mean of the colours, which is linear in the light and sharper than one colour.

    The mean is not linear if a colour is clipped: such a pixel is set to full scale. (Otherwise a red spot
    clips unnoticed at 30 % of full scale.)

    Args:
        image: (height, width), or (height, width, colours) in the order blue, green, red; uint8 or uint16.
        full_scale_dn: value of a clipped colour; None: found from the image, as `default_saturation_dn`.
        margin_dn: distance from it within which a colour counts as clipped, as after compression.
    """
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[:, :, 0]
    grey: Image = np.asarray(cv2.cvtColor(image[:, :, :3], cv2.COLOR_BGR2GRAY), dtype=image.dtype)
    blue, green, red = cv2.split(image)[:3]
    brightest = np.asarray(cv2.max(cv2.max(blue, green), red), dtype=image.dtype)
    full_scale_dn = default_saturation_dn(brightest) if full_scale_dn is None else full_scale_dn
    # Means of left-aligned values use all 16 bits, so that their full scale is that of 16 bits.
    grey[brightest >= full_scale_dn - margin_dn] = full_scale_dn | (0xFFFF if full_scale_dn % 2 == 0 else 0)
    return grey
