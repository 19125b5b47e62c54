"""Grey frames of colour images: the mean of the colours, and full scale where one is clipped."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.frames import default_saturation_dn
from workbench.spots.grey import to_grey


@pytest.mark.parametrize(("kind", "full"), [(np.uint8, 255), (np.uint16, 1023), (np.uint16, 4095)])
def test_a_pixel_clipped_in_one_colour_is_clipped(kind: type[np.unsignedinteger], full: int) -> None:
    image = np.full((8, 9, 3), 20, kind)
    image[4, 5:7] = ((20, 20, full - 1), (20, 20, full))
    grey = to_grey(image)
    assert grey.dtype == kind
    assert grey[4, 4:7].tolist() == [20, round(0.299 * (full - 1) + 0.701 * 20), full]
    assert default_saturation_dn(grey) == full


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_left_aligned_colours_are_clipped_at_their_full_scale(bits: int) -> None:
    step = 2 ** (16 - bits)
    image = np.full((8, 9, 3), 20 * step, np.uint16)
    image[4, 5:7] = ((20 * step, 20 * step, 2**16 - 2 * step), (20 * step, 20 * step, 2**16 - step))
    grey = to_grey(image)
    assert (grey >= default_saturation_dn(grey)).sum() == 1
    assert grey[4, 6] >= default_saturation_dn(grey)


def test_a_grey_image_is_itself() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert to_grey(image) is image
    np.testing.assert_array_equal(to_grey(image[:, :, None]), image)
