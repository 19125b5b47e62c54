"""Frames with and without the blocks of JPEG."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from workbench.model.arrays import Image
from workbench.spots.jpeg_blocks import has_jpeg_blocks

SEEDS = range(1, 13)


def frame(seed: int, noise_dn: float = 2.0) -> Image:
    """A dark room with a gradient, some things in it, a spot, noise."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:240, :320]
    picture = 20 + 0.05 * u + 0.03 * v
    for left, top, width, height, tone in rng.uniform(0, 1, (6, 5)):
        rows = slice(int(240 * top), int(240 * (top + height)))
        picture[rows, int(320 * left) : int(320 * (left + width))] += 15 * tone
    at_u, at_v = rng.uniform(60, 180, 2)
    picture += 150 * np.exp(-((u - at_u) ** 2 + (v - at_v) ** 2) / 2 / 1.5**2)
    return np.asarray(np.clip(np.rint(picture + rng.normal(0, noise_dn, picture.shape)), 0, 255), np.uint8)


def compressed(image: Image, quality: int) -> Image:
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)


@pytest.mark.parametrize("noise_dn", [0.5, 2.0, 5.0])
def test_frames_as_the_sensor_gives_them_have_no_blocks(noise_dn: float) -> None:
    assert not any(has_jpeg_blocks(frame(seed, noise_dn)) for seed in SEEDS)


@pytest.mark.parametrize("quality", [50, 75, 85])
def test_blocks_of_compressed_frames_are_seen(quality: int) -> None:
    seen = [has_jpeg_blocks(compressed(frame(seed), quality)) for seed in SEEDS]
    assert sum(seen) >= len(seen) - 1


def test_frames_without_structure_or_too_small_have_no_blocks() -> None:
    assert not has_jpeg_blocks(np.zeros((240, 320), np.uint8))
    assert not has_jpeg_blocks(np.full((240, 320), 1000, np.uint16))
    assert not has_jpeg_blocks(frame(1)[:20, :20])
