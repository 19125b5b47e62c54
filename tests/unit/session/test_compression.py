"""Notes on compressed images of captures."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from workbench.model.captures import BOARD, CaptureRow
from workbench.session.compression import compression_notes


def row(path: Path, laser_id: str = "1") -> CaptureRow:
    return CaptureRow(row=2, laser_id=laser_id, standoff_mm=500.0, repeat=0, on=path)


def picture(folder: Path, name: str, quality: int | None = None) -> Path:
    v, u = np.mgrid[:120, :160]
    spot = 150 * np.exp(-((u - 71) ** 2 + (v - 53) ** 2) / 8)
    light = 20 + 0.1 * u + spot + np.random.default_rng(1).normal(0, 2, u.shape)
    image = np.asarray(np.clip(light, 0, 255), np.uint8)
    if quality is not None:
        data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        image = np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)
    path = folder / name
    cv2.imwrite(str(path), image)
    return path


@pytest.mark.parametrize(
    ("name", "quality", "noted"), [("a.png", None, False), ("a.jpg", None, True), ("a.png", 50, True)]
)
def test_compressed_images_are_noted(tmp_path: Path, name: str, quality: int | None, noted: bool) -> None:
    assert bool(compression_notes([row(picture(tmp_path, name, quality))])) == noted


def test_photographs_of_a_board_and_rows_without_images_are_not_noted(tmp_path: Path) -> None:
    board = row(picture(tmp_path, "board.jpg"), BOARD)
    position = CaptureRow(row=3, laser_id="1", standoff_mm=500.0, repeat=0, u_px=3.0)
    assert compression_notes([board, position]) == []
