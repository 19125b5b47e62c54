"""Aid for aiming and focusing lasers, on the virtual bench without noise."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.ideal import CX, F, ideal_rig, laser
from tests.support.plain_bench import PlainLasers, plain_bench
from workbench.model.calibration import load_calibration
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.aiming import Aim
from workbench.session.manifest import load_session_rig

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"
CY_PX = 59.5


def a_rig(tx: float = 0.0) -> Rig:
    """Two lasers, of which the second is turned by tx; the principal point is known to 0.1 px."""
    camera = {"height_px": 120, "cx_px": {"value": CX, "sd": 0.1}, "cy_px": {"value": CY_PX, "sd": 0.1}}
    return ideal_rig(laser("L1", -60.0), laser("L2", 60.0, tx=tx), camera=camera)


def an_aim(folder: Path, rig: Rig) -> Aim:
    return Aim(rig, plain_bench(rig, folder))


@pytest.mark.parametrize("standoff_mm", [250.0, 400.0])
def test_each_laser_is_compared_with_where_the_rig_file_expects_it(
    tmp_path: Path, standoff_mm: float
) -> None:
    aim = an_aim(tmp_path, a_rig())
    aim.get_ready()
    aim.place(standoff_mm)
    for one, x_mm in zip(aim.read_all(0), (-60.0, 60.0), strict=True):
        assert one.spot is not None
        assert one.expected is not None
        assert one.expected.u_px == pytest.approx(CX + F * x_mm / standoff_mm, abs=0.01)
        assert one.spot.u_px == pytest.approx(one.expected.u_px, abs=0.5)
        assert one.spot.v_px == pytest.approx(CY_PX, abs=0.5)
        assert one.ambient_dn < 10


def test_without_a_standoff_nothing_is_expected(tmp_path: Path) -> None:
    aim = an_aim(tmp_path, a_rig())
    aim.bench.target.place(Placement(key="p", standoff_mm=500.0))
    aim.place(None)
    assert [one.expected for one in aim.read_all(0)] == [None, None]
    assert aim.directions_mrad() == {}


@pytest.mark.parametrize("tx", [-0.02, 0.0, 0.01])
def test_directions_are_relative_to_the_mean_of_the_beams(tmp_path: Path, tx: float) -> None:
    aim = an_aim(tmp_path, a_rig(tx))
    for standoff_mm in (250.0, 400.0):
        assert aim.directions_mrad() == {}
        aim.place(standoff_mm)
        list(aim.read_all(0))
    found = aim.directions_mrad()
    assert found["L1"] == pytest.approx((-500.0 * tx, 0.0), abs=0.3)
    assert found["L2"] == pytest.approx((500.0 * tx, 0.0), abs=0.3)


def test_the_smallest_width_is_of_the_present_standoff(tmp_path: Path) -> None:
    aim = an_aim(tmp_path, a_rig())
    aim.place(250.0)
    first, second = (aim.read("L1", number) for number in (0, 1))
    assert first.spot is not None
    assert second.spot is not None
    assert second.least_width_px == min(first.spot.width_px, second.spot.width_px)
    aim.place(400.0)
    farther = aim.read("L1", 2)
    assert farther.spot is not None
    assert farther.least_width_px == farther.spot.width_px


def test_a_beam_that_misses_is_no_spot_and_the_lasers_are_off(tmp_path: Path) -> None:
    aim = an_aim(tmp_path, a_rig(tx=1.0))
    aim.place(300.0)
    seen, missing = aim.read_all(0)
    assert seen.spot is not None
    assert missing.spot is None
    assert missing.failures
    assert isinstance(aim.bench.lasers, PlainLasers)
    assert aim.bench.lasers.on == ()


def test_a_calibration_is_compared_with_instead_of_the_rig_file(tmp_path: Path) -> None:
    rig = load_session_rig(SESSION)
    calibration = load_calibration(SESSION / "calibration.yaml")
    aim = Aim(rig, plain_bench(rig, tmp_path), calibration)
    aim.place(800.0)
    one = aim.read("L4", 0)
    assert one.spot is not None
    assert one.expected is not None
    assert one.expected.u_sd_px is None
    # The placement of the bench is 0.3 mm and half a degree off: 0.3 px.
    assert one.spot.u_px == pytest.approx(one.expected.u_px, abs=1.0)
    assert one.spot.v_px == pytest.approx(one.expected.v_px, abs=1.0)
