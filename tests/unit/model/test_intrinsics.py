"""Intrinsics of other sizes of the image, and the priors made of them."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from workbench.model.errors import BadInputError
from workbench.model.intrinsics import ESTIMATED_SD, Intrinsics, camera_values, for_image

FOUND = Intrinsics(
    format="a file",
    size_px=(1280, 960),
    f_px=(1000.0, 1002.0),
    centre_px=(650.0, 470.0),
    lens="plumb_bob",
    coefficients={"k1": -0.3, "p1": 0.001},
)


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_binning_scales_f_and_the_centre_as_the_pixels_show(factor: int) -> None:
    width, height = 1280 // factor, 960 // factor
    found = for_image(FOUND, (width, height))
    assert found.f_px == pytest.approx((1000.0 / factor, 1002.0 / factor))
    # A Gaussian spot about the principal point, binned, has its centroid at the scaled one.
    u, v = np.meshgrid(np.arange(1280), np.arange(960))
    spot = np.exp(-((u - 650.0) ** 2 + (v - 470.0) ** 2) / 2 / 20.0**2)
    binned = cv2.resize(
        spot[: height * factor, : width * factor], (width, height), interpolation=cv2.INTER_AREA
    )
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    centroid = (binned * x).sum() / binned.sum(), (binned * y).sum() / binned.sum()
    assert found.centre_px == pytest.approx(centroid, abs=1e-3)


def test_a_file_of_binned_images_gives_the_whole_image() -> None:
    found = for_image(FOUND, (2560, 1920))
    assert found.f_px[0] == pytest.approx(2000.0)
    assert found.centre_px == pytest.approx((1300.5, 940.5))


@pytest.mark.parametrize("size", [(1280, 720), (1024, 768), (640, 400), (1000, 960)])
def test_an_image_that_may_be_cropped_is_refused(size: tuple[int, int]) -> None:
    with pytest.raises(BadInputError, match="cropped"):
        for_image(FOUND, size)


def test_a_stated_region_is_no_unknown_crop() -> None:
    found = for_image(FOUND.cropped(100, 50, 640, 480), (320, 240))
    assert found.centre_px == pytest.approx(((550.5) / 2 - 0.5, (420.5) / 2 - 0.5))


def test_without_a_stated_size_the_centre_must_be_near_the_middle() -> None:
    unknown = replace(FOUND, size_px=None)
    assert for_image(unknown, (1280, 960)).size_px == (1280, 960)
    with pytest.raises(BadInputError, match="1920 x 1440"):
        for_image(replace(FOUND, size_px=None, centre_px=(319.0, 239.0)), (1920, 1440))


def test_priors_have_stated_or_estimated_deviations() -> None:
    values = camera_values(replace(FOUND, sd={"cx_px": 0.7, "k1": 0.004}))
    assert values["f_px"] == pytest.approx({"value": 1001.0, "sd": np.hypot(5.005, 1.0)})
    assert values["cx_px"] == {"value": 650.0, "sd": 0.7}
    assert values["k1"] == {"value": -0.3, "sd": 0.004}
    assert values["k2"] == {"value": 0.0, "sd": ESTIMATED_SD["k2"]}
    assert (values["width_px"], values["height_px"], values["lens"]) == (1280, 960, "plumb_bob")


def test_pixels_that_are_not_square_are_refused() -> None:
    with pytest.raises(BadInputError, match="square"):
        camera_values(replace(FOUND, f_px=(1000.0, 1020.0)))
