"""For any image, a Finding is returned, and every number in it is finite."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.model.arrays import FloatArray, Image
from workbench.model.errors import BadInputError
from workbench.spots import Failure, Finding, Scanline, find_spots

LINES = st.sampled_from(
    [(), (Scanline(0, 5, 1, 0, 2),), (Scanline(5, 0, 0, 1, 2),), (Scanline(0, 0, 1, 1, 3),)]
)
SHAPES = st.tuples(st.integers(1, 40), st.integers(1, 40)) | st.sampled_from(
    [(1, 1), (1, 64), (64, 1), (2, 2)]
)
DTYPES = st.sampled_from([np.uint8, np.uint16])
KINDS = st.sampled_from(["noise", "black", "white", "uniform", "sparse", "ramp", "twelve bits", "blob"])


def image(kind: str, shape: tuple[int, int], dtype: type, seed: int) -> Image:
    rng = np.random.default_rng(seed)
    top = int(np.iinfo(dtype).max)
    v, u = np.mgrid[: shape[0], : shape[1]]
    made: dict[str, FloatArray] = {
        "noise": rng.normal(20, rng.uniform(0.1, 8), shape),
        "black": np.zeros(shape),
        "white": np.full(shape, float(top)),
        "uniform": rng.integers(0, top, shape, endpoint=True).astype(float),
        "sparse": np.where(rng.random(shape) < 0.03, float(top), 0.0),
        "ramp": np.asarray(u * float(top) / max(shape[1] - 1, 1), np.float64),
        "twelve bits": rng.integers(0, min(top, 4095), shape, endpoint=True).astype(float),
        "blob": 2.0 * top * np.exp(-((u - 5.0) ** 2 + (v - 5.0) ** 2) / rng.uniform(0.2, 60)),
    }
    numbers = np.clip(np.rint(made[kind]), 0, top)
    return numbers.astype(np.uint8) if top == 255 else numbers.astype(np.uint16)


def check(finding: Finding) -> None:
    for spot in finding.spots:
        numbers = (
            spot.u_px,
            spot.v_px,
            spot.u_sd_px,
            spot.v_sd_px,
            spot.flux_dn,
            spot.width_px,
            spot.peak_dn,
        )
        assert np.isfinite(numbers).all()
        assert min(numbers[2:]) > 0
    assert finding.spots or Failure.NO_SPOT in finding.failures


@settings(max_examples=120)
@given(KINDS, SHAPES, DTYPES, st.integers(0, 2**31), LINES, st.none() | KINDS, st.none() | st.integers(0, 5))
def test_no_image_breaks_the_search(
    kind: str,
    shape: tuple[int, int],
    dtype: type,
    seed: int,
    lines: tuple[Scanline, ...],
    off: str | None,
    expected: int | None,
) -> None:
    dark = None if off is None else image(off, shape, dtype, seed + 1)
    check(find_spots(image(kind, shape, dtype, seed), dark, scanlines=lines, expected=expected))


@settings(max_examples=40)
@given(
    st.lists(st.integers(0, 5), min_size=0, max_size=4),
    st.sampled_from(["uint8", "uint16", "float32", "int32", "bool"]),
)
def test_what_is_no_grey_image_is_refused_by_name(shape: list[int], dtype: str) -> None:
    frame = np.zeros(shape, dtype)
    if len(shape) == 2 and 0 not in shape and dtype in ("uint8", "uint16"):
        check(find_spots(frame))
    else:
        with pytest.raises(BadInputError, match="expected a grey image"):
            find_spots(frame)


@pytest.mark.parametrize("frame", [[[1], [1, 2]], None, "on.png"])
def test_what_is_no_array_is_refused_by_name(frame: Any) -> None:
    with pytest.raises(BadInputError, match="expected a grey image"):
        find_spots(frame)
