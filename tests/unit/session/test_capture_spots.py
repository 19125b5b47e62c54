"""Spots of one row of a captures file that names images."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, profile
from tests.support.rigs import thesis_rig
from workbench.calibration.data.spot_rows import prior_scanline
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.session.capture_spots import find_row_spots
from workbench.spots import Failure

SIZE = (640, 480)
RIG = thesis_rig()
LINES = [prior_scanline(RIG, RIG.lasers[0])]


def image(path: Path, spots: list[Drawn], seed: int, shape: tuple[int, int] = (480, 640)) -> None:
    light = sum((profile(shape, spot) for spot in spots), np.zeros(shape))
    cv2.imwrite(str(path), Sensor(bits=8, electrons_per_dn=20.0).expose(light, np.random.default_rng(seed)))


def captures(folder: Path, row: str) -> Path:
    path = folder / "c.csv"
    path.write_text(f"laser_id,standoff_mm,repeat,on,off,u_px,v_px\n{row}\n")
    return path


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_spot_is_found_in_the_rows_images(tmp_path: Path, seed: int) -> None:
    """At u 200.3; a lamp that burns in both frames is no spot."""
    lamp = Drawn(500.0, 239.0, 2e4)
    image(tmp_path / "on.png", [Drawn(200.3, 239.6), lamp], seed)
    image(tmp_path / "off.png", [lamp], seed + 100)
    (row,) = load_captures(captures(tmp_path, "L1,500,0,on.png,off.png,,"))
    (spot,) = find_row_spots(row, SIZE, LINES, 1, 0.0).spots
    assert abs(spot.u_px - 200.3) < 5 * spot.u_sd_px
    assert abs(spot.v_px - 239.6) < 5 * spot.v_sd_px


@pytest.mark.parametrize("fault", ["missing", "other size", "text"])
def test_an_image_that_cannot_be_used_is_named_with_its_row(tmp_path: Path, fault: str) -> None:
    image(tmp_path / "on.png", [Drawn(200.3, 239.6)], 1)
    if fault == "other size":
        image(tmp_path / "off.png", [], 2, (100, 640))
    if fault == "text":
        (tmp_path / "off.png").write_text("no picture")
    (row,) = load_captures(captures(tmp_path, "L1,500,0,on.png,off.png,,"))
    with pytest.raises(BadInputError, match=r"^row 2: .*off\.png") as caught:
        find_row_spots(row, SIZE, LINES, 1, 0.0)
    assert caught.value.exit_code == 2


def test_a_row_of_pixel_positions_has_no_images(tmp_path: Path) -> None:
    (row,) = load_captures(captures(tmp_path, "L1,500,0,,,200,239"))
    with pytest.raises(ValueError, match="row 2"):
        find_row_spots(row, SIZE, LINES, 1, 0.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_exchanged_images_are_named(tmp_path: Path, seed: int) -> None:
    image(tmp_path / "on.png", [Drawn(200.3, 239.6)], seed)
    image(tmp_path / "off.png", [], seed + 100)
    (row,) = load_captures(captures(tmp_path, "L1,500,0,off.png,on.png,,"))
    found = find_row_spots(row, SIZE, LINES, 1, 0.0)
    assert found.spots == ()
    assert found.failures[0] is Failure.ON_OFF_EXCHANGED


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_images_without_a_spot_are_not_exchanged(tmp_path: Path, seed: int) -> None:
    image(tmp_path / "on.png", [], seed)
    image(tmp_path / "off.png", [], seed + 100)
    (row,) = load_captures(captures(tmp_path, "L1,500,0,on.png,off.png,,"))
    assert Failure.ON_OFF_EXCHANGED not in find_row_spots(row, SIZE, LINES, 1, 0.0).failures


def test_a_spot_clipped_in_red_is_saturated(tmp_path: Path) -> None:
    """Its weighted mean is at 30 % of full scale."""
    shape, rng = (480, 640), np.random.default_rng(1)
    red = Sensor(bits=8, electrons_per_dn=20.0).expose(profile(shape, Drawn(200.3, 239.6, 6e5)), rng)
    assert (red == 255).sum() > 4
    cv2.imwrite(str(tmp_path / "on.png"), cv2.merge([red // 16, red // 16, red]))
    cv2.imwrite(str(tmp_path / "off.png"), np.zeros((*shape, 3), np.uint8))
    (row,) = load_captures(captures(tmp_path, "L1,500,0,on.png,off.png,,"))
    (spot,) = find_row_spots(row, SIZE, LINES, 1, 0.0).spots
    assert Failure.SATURATED in spot.flags


@pytest.mark.parametrize("step", [1, 16])
def test_a_spot_of_12_bits_is_saturated_left_or_right_aligned(tmp_path: Path, step: int) -> None:
    shape, rng = (480, 640), np.random.default_rng(1)
    on = Sensor(bits=12, electrons_per_dn=2.0).expose(profile(shape, Drawn(200.3, 239.6, 6e5)), rng)
    off = Sensor(bits=12, electrons_per_dn=2.0).expose(np.zeros(shape), rng)
    for name, frame in (("on", on), ("off", off)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), step * frame)
    (row,) = load_captures(captures(tmp_path, "L1,500,0,on.png,off.png,,"))
    (spot,) = find_row_spots(row, SIZE, LINES, 1, 0.0).spots
    assert Failure.SATURATED in spot.flags
