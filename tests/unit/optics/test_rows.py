"""Rows of lasers: found by their beams, whatever their direction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.model.arrays import FloatArray
from workbench.model.rig import load_rig
from workbench.optics.rows import Row, axes_of, rows_of, rows_of_rig

ROOT = Path(__file__).parents[3]
BASELINES_MM = (-60.0, -30.0, 30.0, 60.0)
BY_EYE = (0.2, 0.2, 0.005, 0.005)
"""1 sigma of a laser's mount: mm and tangents."""


def row_at(angle_deg: float, aside_mm: float = 0.0) -> list[list[float]]:
    """Parallel beams on a line at an angle, which passes the optical axis at a distance."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return [[b * c - aside_mm * s, b * s + aside_mm * c, 0.0, 0.0] for b in BASELINES_MM]


def ring(count: int) -> list[list[float]]:
    angle = 2 * np.pi * np.arange(count) / count
    return [[60 * np.cos(a), 60 * np.sin(a), 0.0, 0.0] for a in angle]


def fan(count: int = 15) -> list[list[float]]:
    """Beams of one grating beside the camera."""
    return [[60.0, 0.0, 0.0, np.tan(0.0325 * order)] for order in range(-(count // 2), count // 2 + 1)]


def found(rays: list[list[float]]) -> list[tuple[tuple[int, ...], str]]:
    return [(row.members, row.name) for row in rows_of(np.array(rays))]


def bend_px(rays: FloatArray, members: tuple[int, ...], wall_mm: float) -> float:
    """Largest distance of a row's spots on a wall from their straight line, px: a pinhole of 533 px."""
    at = rays[list(members)]
    spots = 533.0 * (at[:, :2] / wall_mm + at[:, 2:])
    across = np.linalg.svd(spots - spots.mean(axis=0))[2][1]
    return float(np.abs((spots - spots.mean(axis=0)) @ across).max())


@pytest.mark.parametrize(
    ("angle_deg", "name"), [(0, "horizontal"), (90, "vertical"), (45, "45 deg"), (-60, "120 deg")]
)
def test_a_row_has_any_direction(angle_deg: float, name: str) -> None:
    assert found(row_at(angle_deg)) == [((0, 1, 2, 3), name)]


def test_three_lines_through_the_camera_are_three_rows() -> None:
    rays = row_at(0) + row_at(60) + row_at(120)
    assert [members for members, _ in found(rays)] == [(0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11)]


@pytest.mark.parametrize("count", [3, 5, 7, 9])
def test_lasers_on_a_ring_with_no_two_opposite_are_on_no_row(count: int) -> None:
    assert sorted(members for members, _ in found(ring(count))) == [(n,) for n in range(count)]


@pytest.mark.parametrize("count", [4, 6, 12])
def test_opposite_lasers_of_a_ring_are_in_a_row_with_the_pinhole(count: int) -> None:
    half = count // 2
    assert sorted(members for members, _ in found(ring(count))) == [(n, n + half) for n in range(half)]


def test_a_row_beside_the_camera_is_not_the_axis_along_which_its_spots_move() -> None:
    rays = row_at(0, aside_mm=-40.0)
    assert found(rays) == [((0, 1, 2, 3), "horizontal")]
    up = np.degrees(np.arctan2(*axes_of(np.array(rays)).T[::-1]))
    assert up == pytest.approx(
        [np.degrees(np.arctan2(40, 60)), np.degrees(np.arctan2(40, 30)), 127, 146], abs=1
    )


def test_the_beams_of_a_grating_are_a_row_across_their_baseline() -> None:
    assert found(fan()) == [((*range(15),), "vertical")]
    assert axes_of(np.array(fan())).tolist() == [[1.0, 0.0]] * 15


def test_each_laser_is_in_one_row_the_longest_first() -> None:
    """A grid of 3 x 4: its rows of four, not its columns of three."""
    grid = [[30.0 * x, 20.0 * y, 0.0, 0.0] for y in (-1, 0, 1) for x in (-1.5, -0.5, 0.5, 1.5)]
    assert [members for members, _ in found(grid)] == [(0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11)]


def test_two_lasers_of_a_rig_are_a_row_and_of_three_those_about_the_camera() -> None:
    assert found([[-30.0, -40.0, 0, 0], [30.0, -40.0, 0, 0]]) == [((0, 1), "horizontal")]
    assert found([[-30.0, 0, 0, 0], [0, 40.0, 0, 0], [45.0, 0, 0, 0]])[0][0] == (0, 2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_of_the_mount_change_neither_rows_nor_directions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    designs = (row_at(0) + row_at(90), row_at(45), row_at(0) + row_at(60) + row_at(120))
    for rays in designs:
        for _ in range(100):
            assert found((np.array(rays) + rng.normal(size=(len(rays), 4)) * BY_EYE).tolist()) == found(rays)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spots_of_a_row_lie_on_a_straight_line_on_every_wall_and_others_do_not(seed: int) -> None:
    """By the pinhole projection above, for lasers at random."""
    rng = np.random.default_rng(seed)
    scattered = [[*rng.uniform(-80, 80, 2), 0.0, 0.0] for _ in range(3)]
    rays = np.array(row_at(float(rng.integers(180)), float(rng.uniform(30, 60))) + scattered)
    rows = rows_of(rays)
    long = max(rows, key=lambda row: len(row.members))
    assert set(long.members) >= {0, 1, 2, 3}
    for wall_mm in (200.0, 700.0, 3000.0):
        length_px = 533.0 * np.ptp(rays[list(long.members), :2] @ long.direction) / wall_mm
        assert bend_px(rays, long.members, wall_mm) < length_px / 20
        for other in set(range(7)) - set(long.members):
            assert bend_px(rays, (*long.members, other), wall_mm) > 533.0 * 0.02 * 120.0 / wall_mm


def test_positions_count_along_the_row() -> None:
    assert Row((0,), 0).direction.tolist() == [1.0, 0.0]
    assert Row((0,), 90).direction.tolist() == [0.0, 1.0]
    assert Row((0,), 120).direction == pytest.approx([-0.5, np.sqrt(0.75)])


@pytest.mark.parametrize(
    ("rig", "names"),
    [
        ("thesis", ["horizontal"]),
        ("thesis-both", ["horizontal", "vertical"]),
        ("diagonal", ["45 deg"]),
        ("three-lines", ["horizontal", "60 deg", "120 deg"]),
    ],
)
def test_rows_of_the_rigs_of_the_repository(rig: str, names: list[str]) -> None:
    rows = rows_of_rig(load_rig(ROOT / f"rigs/{rig}-emulated.yaml"))
    assert [(row.name, len(row.members)) for row in rows] == [(name, 4) for name in names]


def test_no_lasers_are_no_row() -> None:
    assert rows_of(np.zeros((0, 4))) == ()
