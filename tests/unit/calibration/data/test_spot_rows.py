"""The band in which a laser's spots are searched, by the rig file and by a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.rigs import (
    FISHEYE_STANDOFFS_MM,
    PROVENANCE,
    World,
    fisheye_rig,
    grating_rig,
    prior,
    thesis_rig,
)
from tests.support.scanned_head import SimulatedHead, inclined_rig
from workbench.calibration.data import spot_rows
from workbench.calibration.data.observations import PlacementInfo
from workbench.calibration.data.spot_rows import (
    BEAM_HALF_WIDTH_PX,
    PRIOR_REACH_SD,
    observations_of_rows,
    own_spots,
    prior_scanline,
    prior_scanlines,
    sought,
)
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import Image
from workbench.model.board import Board
from workbench.model.captures import CaptureRow
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig, load_rig
from workbench.ranging.ranger import SCANLINE_HALF_WIDTH_PX, Ranger
from workbench.spots import Failure, Finding, Spot
from workbench.spots.strip import distance_px

HEAD_RIG = Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml"


def tilted(ty: float) -> Rig:
    """A fisheye rig known but for small tolerances, its beams tilted across their baseline."""
    rig = fisheye_rig()
    lasers = tuple(laser.model_copy(update={"ty": prior(ty, 0.0005)}) for laser in rig.lasers)
    camera = rig.camera.model_copy(
        update={"cx_px": prior(319.5, 0.1), "cy_px": prior(239.5, 0.1), "f_px": prior(305.6, 0.5)}
    )
    return rig.model_copy(update={"lasers": lasers, "camera": camera})


@pytest.mark.parametrize("ty", [0.0, 0.2, -0.4])
def test_bands_hold_the_bent_line_of_a_tilted_beam_before_a_fisheye(ty: float) -> None:
    rig = tilted(ty)
    world = World(rig, 1)
    fitted = fit(rig, world.observations(FISHEYE_STANDOFFS_MM))
    ranger = Ranger(calibrate(fitted, Acceptance(), PROVENANCE)[0])
    for laser, calibrated in zip(rig.lasers, ranger.scanlines, strict=True):
        spots = np.array([world.pixel(laser.id, z) for z in np.geomspace(45.0, 5000.0, 40)])
        spots = spots[(spots[:, 0] > 0) & (spots[:, 0] < 639)]
        for line in (prior_scanline(rig, laser), calibrated):
            # Two thirds of the beam's own width are left beside the line's bend.
            assert (distance_px(line, *spots.T) < line.half_width_px - 0.6 * BEAM_HALF_WIDTH_PX).all()


def test_a_straight_line_has_the_width_of_its_beam() -> None:
    rig = thesis_rig()
    camera = {"cx_px": prior(319.5, 0.0), "cy_px": prior(239.5, 0.0)}
    lasers = tuple(s.model_copy(update={"tx": prior(0, 0), "ty": prior(0, 0)}) for s in rig.lasers)
    rig = rig.model_copy(update={"camera": rig.camera.model_copy(update=camera), "lasers": lasers})
    assert [prior_scanline(rig, s).half_width_px for s in rig.lasers] == [BEAM_HALF_WIDTH_PX] * 4
    fitted = fit(thesis_rig(), World(thesis_rig(), 1).observations())
    ranger = Ranger(calibrate(fitted, Acceptance(), PROVENANCE)[0])
    assert [line.half_width_px for line in ranger.scanlines] == [SCANLINE_HALF_WIDTH_PX] * 4


@pytest.mark.parametrize("baseline_mm", [(30.0, 40.0), (-50.0, 0.0), (0.0, 20.0)])
def test_a_band_is_wider_by_what_is_uncertain_across_the_baseline(baseline_mm: tuple[float, float]) -> None:
    """Principal point and pointing move a line along u and v; the covariance is projected on the normal."""
    rig = thesis_rig()
    x_mm, y_mm = baseline_mm
    camera = rig.camera.model_copy(update={"cx_px": prior(319.5, 4.0), "cy_px": prior(239.5, 1.0)})
    update = {"x_mm": prior(x_mm, 0.1), "y_mm": prior(y_mm, 0.1), "tx": prior(0, 0.01), "ty": prior(0, 0.03)}
    laser = rig.lasers[0].model_copy(update=update)
    normal = np.array([-y_mm, x_mm]) / np.hypot(x_mm, y_mm)
    by_pointing = rig.camera.f_px.value * np.array([0.01, 0.03])
    sd_px = np.sqrt(normal @ np.diag(np.array([4.0, 1.0]) ** 2 + by_pointing**2) @ normal)
    line = prior_scanline(rig.model_copy(update={"camera": camera}), laser)
    assert line.half_width_px == pytest.approx(BEAM_HALF_WIDTH_PX + PRIOR_REACH_SD * sd_px)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_band_of_a_turned_head_holds_its_spots_at_that_reading_alone(seed: int) -> None:
    """Spots by the virtual bench's geometry, of heads that a seed draws from the priors."""
    rig = inclined_rig(load_rig(HEAD_RIG))
    head = SimulatedHead.of(rig, seed)
    plane = head.plane("p", 400.0)
    points = np.array([head.point("p", plane, reading) for reading in (-30.0, 0.0, 5.0)])
    spots, inside = head.seen(points, 0.0, np.random.default_rng(seed))
    assert inside.all()
    for reading, spot in zip((-30.0, 0.0, 5.0), spots, strict=True):
        line = prior_scanline(rig, rig.head_laser, reading)
        assert distance_px(line, *spot) < line.half_width_px
    at_zero = prior_scanline(rig, rig.head_laser)
    assert distance_px(at_zero, *spots[0]) > at_zero.half_width_px
    assert prior_scanlines(rig, 5.0) == [line]


def grating(count: int, along_baseline: bool = False) -> Rig:
    """A rig whose lasers are beams of one emitter 60 mm beside the camera, the last in the file first."""
    slopes = [0.1 * (n - count // 2) for n in reversed(range(count))]
    return grating_rig({"tx" if along_baseline else "ty": prior(slope, 0.005)} for slope in slopes)


@pytest.mark.parametrize("along_baseline", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spots_of_one_emitter_are_assigned_by_their_order_in_the_row(along_baseline: bool, seed: int) -> None:
    """The fan across the baseline or along it, by OpenCV's projection of rays that a seed draws."""
    rig = grating(5, along_baseline)
    world = World(rig, seed)
    for standoff_mm in (150.0, 600.0, 4000.0):
        exact = {laser.id: world.pixel(laser.id, standoff_mm) for laser in rig.lasers}
        shuffled = np.random.default_rng(seed).permutation(list(exact.values())).tolist()
        finding = Finding(tuple(Spot(u, v, 0.03, 0.03, 1e4, 1.5, 150.0) for u, v in shuffled))
        for laser in rig.lasers:
            (own,) = own_spots(rig, laser, finding).spots
            assert (own.u_px, own.v_px) == pytest.approx(tuple(exact[laser.id]))


def test_without_all_spots_of_an_emitter_none_is_assigned() -> None:
    rig = grating(5)
    spots = tuple(Spot(300.0, 100.0 + 20 * n, 0.03, 0.03, 1e4, 1.5, 150.0) for n in range(4))
    assert own_spots(rig, rig.lasers[0], Finding(spots, (Failure.TOO_FEW,))) == Finding(
        (), (Failure.TOO_FEW,)
    )
    alone = thesis_rig()
    assert own_spots(alone, alone.lasers[0], Finding(spots)) == Finding(spots)
    assert sought(rig, rig.lasers[0])[1] == 5
    assert sought(alone, alone.lasers[0]) == ([prior_scanline(alone, alone.lasers[0])], 1)


def test_beams_of_an_emitter_in_no_row_are_refused() -> None:
    rig = grating(5)
    astray = rig.lasers[1].model_copy(update={"tx": prior(0.3, 0.005)})
    rig = rig.model_copy(update={"lasers": (rig.lasers[0], astray, *rig.lasers[2:])})
    with pytest.raises(BadInputError, match="emitter g in one row") as caught:
        sought(rig, rig.lasers[0])
    assert caught.value.exit_code == 2


def row(number: int, laser_id: str, standoff_mm: float | None, **cells: Any) -> CaptureRow:
    known = {} if standoff_mm is None else {"standoff_mm": standoff_mm}
    return CaptureRow.model_validate({"row": number, "laser_id": laser_id, "repeat": 0, **known, **cells})


def test_rows_of_single_lasers_at_known_standoffs_are_observations() -> None:
    rows = [
        row(2, "L1", 500.0, u_px=200.0, v_px=240.0, tilt_deg=3.0),
        row(3, "all", 500.0, on=Path("nowhere.png")),
        row(4, "L1", None, u_px=200.0),
        row(5, "L9", 500.0, u_px=200.0),
        row(6, "L2", 700.0, u_px=250.0, scene="s", placement="p"),
        row(7, "L2", 700.0, u_px=5000.0),
    ]
    observations, rejected, boards = observations_of_rows(thesis_rig(), rows)
    assert [(s.source, s.laser_id, s.placement, s.yaw_deg) for s in observations] == [
        ("row 2", "L1", "500 mm", 3.0),
        ("row 6", "L2", "p", 0.0),
    ]
    assert [one.source for one in rejected] == ["row 3", "row 4", "row 5", "row 7"]
    assert boards == []


def test_all_frames_of_a_board_at_one_placement_are_one_view(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[list[float], PlacementInfo]] = []

    def see(frames: list[Image], board: Board, placement: PlacementInfo) -> Rejected:
        seen.append(([float(frame[0, 0]) for frame in frames], placement))
        return Rejected(placement.source, "for a test")

    def read(path: Path, size: tuple[int, int]) -> Image:
        return np.full(size[::-1], int(path.stem), np.uint8)

    monkeypatch.setattr(spot_rows, "see_board", see)
    monkeypatch.setattr("workbench.session.frames.read_image", read)
    rows = [
        row(2, "board", 300.0, on=Path("1.png"), placement="a", tilt_deg=10.0, standoff_sd_mm=0.7),
        row(3, "board", 300.0, on=Path("2.png"), placement="a"),
        row(4, "board", 400.0, on=Path("3.png")),
        row(5, "board", None, on=Path("4.png"), placement="b"),
    ]
    _, rejected, _ = observations_of_rows(thesis_rig(), rows)
    assert [frames for frames, _ in seen] == [[1.0, 2.0], [3.0], [4.0]]
    assert [(p.key, p.standoff_mm, p.yaw_deg, p.source) for _, p in seen[:2]] == [
        ("a", 300.0, 10.0, "row 2"),
        ("400 mm", 400.0, 0.0, "row 4"),
    ]
    assert np.isnan(seen[2][1].standoff_mm), "a board held anywhere"
    assert seen[0][1].standoff_sd_mm == 0.7
    assert [one.source for one in rejected] == ["row 2", "row 4", "row 5"]
