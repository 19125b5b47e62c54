"""Both lines of lasers, and the vertical one alone, on the virtual bench."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.bench.sensors import calibration_of
from workbench.emulator.bench import EmulatedBench, open_bench
from workbench.model.rig import Rig, load_rig, nearest_image_axis
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement, TargetShape
from workbench.ranging.lines import Weights
from workbench.ranging.live import LiveRanger
from workbench.ranging.ranger import Ranger, Reading
from workbench.ranging.shape import Shape

ROOT = Path(__file__).parents[2]
SEEDS = (2001, 7)


def rig_of(seed: int, axes: str) -> Rig:
    """The rig of both lines on a bench where every target stands exactly as it is put."""
    rig = load_rig(ROOT / "rigs/thesis-both-emulated.yaml")
    lasers = tuple(laser for laser in rig.lasers if nearest_image_axis(laser) in axes)
    steady = {"placement_sd_mm": 0.0, "tilt_sd_deg": 0.0, "target_tilt_sd_deg": 0.0}
    exact = rig.bench.model_copy(update=steady)
    return rig.model_copy(update={"lasers": lasers, "bench": exact, "emulator": {"seed": seed}})


class Setup:
    """A bench and its ranger."""

    def __init__(self, seed: int, axes: str, folder: Path) -> None:
        self.rig = rig_of(seed, axes)
        self.bench: EmulatedBench = open_bench(self.rig, folder / "live")
        tolerant = load_rig(ROOT / "rigs/thesis-both-emulated.yaml").bench
        self.calibration = calibration_of(self.rig.model_copy(update={"bench": tolerant}))

    def read(self, target: TargetShape, standoff_mm: float, weights: Weights = "information") -> Reading:
        key = f"{target.shape}/{standoff_mm:g}/{target.model_dump_json()}"
        self.bench.target.place(Placement(key=key, standoff_mm=standoff_mm, target=target))
        return LiveRanger(Ranger(self.calibration, weights), self.bench).read(key)


@pytest.fixture(scope="module", params=SEEDS)
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Setup]:
    setup = Setup(request.param, "uv", tmp_path_factory.mktemp("both"))
    with setup.bench:
        yield setup


@pytest.fixture(scope="module", params=SEEDS)
def vertical(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Setup]:
    setup = Setup(request.param, "v", tmp_path_factory.mktemp("vertical"))
    with setup.bench:
        yield setup


def shapes(reading: Reading) -> dict[str, Shape]:
    return {line.row.name: line.shape for line in reading.lines}


def angle_deg(shape: Shape) -> tuple[float, float]:
    assert shape.angle_rad is not None
    assert shape.angle_sigma_rad is not None
    return float(np.degrees(shape.angle_rad)), float(np.degrees(shape.angle_sigma_rad))


@pytest.mark.long_cases
def test_a_flat_before_both_lines(both: Setup) -> None:
    reading = both.read(FlatTarget(), 700.0)
    assert reading.status == "done"
    assert [laser.laser_id for laser in reading.lasers] == list(both.rig.laser_ids)
    kinds = {name: shape.kind for name, shape in shapes(reading).items()}
    assert kinds == {"horizontal": "flat", "vertical": "flat"}
    assert reading.mean_mm is not None
    assert reading.mean_sigma_mm is not None
    assert abs(reading.mean_mm - 700.0) < 4 * reading.mean_sigma_mm
    assert reading.mean_sigma_mm <= min(s.closest_sigma_mm for s in shapes(reading).values())


@pytest.mark.parametrize("standoff_mm", [1500.0, 2500.0, 3500.0])
def test_far_away_where_the_spots_of_both_lines_crowd(both: Setup, standoff_mm: float) -> None:
    reading = both.read(FlatTarget(), standoff_mm)
    assert reading.status == "done"
    for laser in reading.lasers:
        assert abs(laser.range_mm - standoff_mm) < 5 * laser.sigma_mm


@pytest.mark.parametrize("angle", [-30.0, 30.0])
def test_each_line_sees_its_own_incline(both: Setup, angle: float) -> None:
    turned, tipped = (
        shapes(both.read(FlatTarget(yaw_deg=angle), 600.0)),
        shapes(both.read(FlatTarget(pitch_deg=angle), 600.0)),
    )
    for seen, receding, level in ((turned, "horizontal", "vertical"), (tipped, "vertical", "horizontal")):
        found, sigma = angle_deg(seen[receding])
        assert seen[receding].kind == "incline"
        assert abs(found - angle) < 4 * sigma
        assert sigma < 1.0
        # Beams of the level line lie up to 0.3 degrees out of one plane: a steep wall makes bumps of that.
        assert abs(seen[level].closest_mm - 600.0) < 6.0


def test_a_line_that_sees_nothing_leaves_the_range_to_the_other(both: Setup) -> None:
    reading = both.read(FlatTarget(height_mm=30.0), 500.0)
    assert reading.status == "not_enough_points"
    assert set(shapes(reading)) == {"horizontal"}
    assert reading.closest_mm is not None
    assert reading.sigma_mm is not None
    assert abs(reading.closest_mm - 500.0) < 4 * reading.sigma_mm


def test_a_cylinder_is_round_across_and_straight_along(both: Setup) -> None:
    seen = shapes(both.read(CylinderTarget(diameter_mm=178.0, shift_mm=15.0), 250.0))
    assert seen["horizontal"].kind in {"cylinder", "round"}
    assert seen["horizontal"].cylinder is not None
    assert abs(seen["horizontal"].cylinder.radius_mm - 89.0) < 4 * seen["horizontal"].cylinder.radius_sigma_mm
    nearest, farthest = seen["horizontal"].closest_interval_mm
    assert nearest - 0.5 < 250.0 < farthest + 0.5


def test_the_thesis_s_weights_are_the_pixels_along_each_line(both: Setup) -> None:
    by_pixels, by_information = (both.read(FlatTarget(), 1500.0, w) for w in ("pixels", "information"))
    u, v = (shapes(by_pixels)[name].closest_mm for name in ("horizontal", "vertical"))
    assert by_pixels.mean_mm == pytest.approx((640 * u + 480 * v) / 1120)
    assert by_information.mean_sigma_mm is not None
    assert by_pixels.mean_sigma_mm is not None
    assert by_information.mean_sigma_mm <= by_pixels.mean_sigma_mm * 1.001


def test_nothing_there(both: Setup) -> None:
    reading = both.read(NoTarget(), 500.0)
    assert (reading.status, reading.lines, reading.closest_mm) == ("no_points", (), None)


@pytest.mark.parametrize("standoff_mm", [250.0, 3000.0])
def test_the_vertical_line_alone(vertical: Setup, standoff_mm: float) -> None:
    reading = vertical.read(FlatTarget(), standoff_mm)
    assert reading.status == "done"
    assert set(shapes(reading)) == {"vertical"}
    assert reading.closest_mm is not None
    assert reading.sigma_mm is not None
    # The ruler's own scale, 0.05 %, is not the calibration's to know.
    assert abs(reading.closest_mm - standoff_mm) < 4 * np.hypot(reading.sigma_mm, 0.0005 * standoff_mm)
