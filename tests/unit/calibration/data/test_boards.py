"""The joint fit of corners and spots against simulated truth, and against the fit of a flat alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.board_world import CORNER_SD_PX, BoardWorld
from tests.support.free_views import BOARD, views
from tests.support.rigs import PROVENANCE, World, board_rig, prior, thesis_rig
from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.data.boards import BoardView, on_boards
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict.assessment import determined_by
from workbench.calibration.verdict.export import calibrate, render
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig

SEEDS = (1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in (2, 3)))
FAR_MM = (600.0, 1400.0, 3200.0)


def joint(rig: Rig, seed: int) -> tuple[CalibrationFit, dict[str, float]]:
    world = World(rig, seed)
    observations, views = BoardWorld(world).measure()
    return fit(rig, [*observations, *world.observations(FAR_MM)], (), views), world.values


def of(result: CalibrationFit, name: str) -> tuple[float, float, float, str]:
    """Value, sd, data share, determined by."""
    i = [p.name for p in result.table.parameters].index(name)
    by = determined_by(result)[i]
    return float(result.values[i]), float(result.sd[i]), float(result.data_share[i]), by


@pytest.mark.parametrize("seed", SEEDS)
def test_the_board_gives_the_focal_length_where_the_flat_does_not(seed: int) -> None:
    rig = board_rig()
    result, truth = joint(rig, seed)
    f, sd, share, by = of(result, "f_px")
    assert abs(f - truth["f_px"]) < 0.001 * truth["f_px"]
    assert sd < 0.001 / 3 * truth["f_px"]
    assert share > 0.999
    assert by == "data"
    directions = calibrate(result, Acceptance(), PROVENANCE)[1].directions
    assert not any("f_px" in one.words for one in directions)

    flat = fit(rig, World(rig, seed).observations())
    assert of(flat, "f_px")[2] < 0.1
    assert of(flat, "f_px")[3] == "joint"
    assert of(flat, "f_px")[1] > 10 * sd


@pytest.mark.thorough
def test_the_truth_lies_where_the_covariance_says() -> None:
    rig = board_rig()
    sensor = [p.name for p in joint(rig, 50)[0].table.parameters if p.kind == "sensor" and p.prior.sd]
    assert "print_scale" in sensor
    distances, corners = [], []
    for seed in range(50, 66):
        result, truth = joint(rig, seed)
        names = [p.name for p in result.table.parameters]
        rows = [names.index(name) for name in sensor]
        error = result.values[rows] - [truth[name] for name in sensor]
        distances.append(float(error @ np.linalg.solve(result.covariance[np.ix_(rows, rows)], error)))
        corners.append(np.mean((result.corner_residual_px / CORNER_SD_PX) ** 2))
        assert result.converged
    n = len(sensor)
    # The mean of 16 chi-squares of n degrees of freedom, variance 2 n each; four of its deviations.
    assert np.mean(distances) == pytest.approx(n, abs=4 * np.sqrt(2 * n / 16))
    # Some 900 coordinates a fit, of which the poses and the lens take 50.
    assert np.mean(corners) == pytest.approx(0.95, abs=0.05)


@pytest.mark.thorough
def test_the_print_s_scale_moves_lengths_and_not_the_lens() -> None:
    """1 % of print error, unknown to the fit: f stays, every length in mm follows the print."""
    rig = board_rig(prior(0.0, 0.0))
    loose = rig.bench.model_copy(update={"ruler_scale": prior(0.0, 1.0), "offset_mm": prior(0.0, 100.0)})
    lasers = tuple(laser.model_copy(update={"x_mm": prior(laser.x_mm.value, 20.0)}) for laser in rig.lasers)
    rig = rig.model_copy(update={"bench": loose, "lasers": lasers})
    observations, views = BoardWorld(World(board_rig(), 4)).measure()
    assumed = rig.bench.model_copy(update={"print_scale": prior(0.01, 0.0)})
    one = fit(rig, observations, (), views)
    other = fit(rig.model_copy(update={"bench": assumed}), observations, (), views)
    assert of(other, "f_px")[0] == pytest.approx(of(one, "f_px")[0], rel=1e-4)
    for name in ("L1.x_mm", "L4.x_mm"):
        assert of(other, name)[0] == pytest.approx(1.01 * of(one, name)[0], rel=1e-3)
    scales = [1 + of(result, "ruler_scale")[0] for result in (one, other)]
    assert scales[1] == pytest.approx(1.01 * scales[0], rel=1e-3)


@pytest.mark.thorough
def test_baselines_are_known_as_well_as_print_ruler_and_calliper_tell() -> None:
    result, _ = joint(board_rig(), 5)
    _, sd, share, by = of(result, "L1.x_mm")
    assert share < 0.1
    assert by == "joint"
    # An exact print leaves the spots' noise; one of 0.05 % adds so much of 60 mm, less what ruler (0.3 mm a
    # placement, 200 to 420 mm) and callipers (0.2 mm in 60) say of the scale: about a fifth.
    _, exact, _, _ = of(joint(board_rig(prior(0.0, 0.0)), 5)[0], "L1.x_mm")
    assert 0.6 < (sd**2 - exact**2) / (60.0 * 0.0005) ** 2 < 1.0


@pytest.mark.thorough
def test_a_start_far_from_the_truth_ends_in_the_same_place() -> None:
    rig = board_rig()
    world = World(rig, 6)
    observations, views = BoardWorld(world).measure()
    shifted = rig.camera.model_copy(update={"f_px": prior(490.0, 1e3), "cx_px": prior(280.0, 1e3)})
    one = fit(rig, observations, (), views)
    other = fit(rig.model_copy(update={"camera": shifted}), observations, (), views)
    assert of(other, "f_px")[0] == pytest.approx(of(one, "f_px")[0], abs=0.1 * of(one, "f_px")[1])


@pytest.mark.thorough
def test_an_unsquare_board_upside_down() -> None:
    """Nothing is assumed of how the board is turned: after half a turn it has another roll."""
    rig = board_rig()
    observations, views = BoardWorld(World(rig, 7)).measure()
    count = len(rig.board.corners_mm)
    # Seen by the board's corners renamed: the board is its own image under half a turn but for the names.
    turned = [replace(v, corners=replace(v.corners, ids=count - 1 - v.corners.ids)) for v in views]
    one, other = fit(rig, observations, (), views), fit(rig, observations, (), turned)
    assert of(other, "f_px")[0] == pytest.approx(of(one, "f_px")[0], rel=1e-6)
    roll = of(other, "B1.board_roll_rad")[0] - of(one, "B1.board_roll_rad")[0]
    assert np.cos(roll) == pytest.approx(-1.0, abs=1e-6)


def test_what_the_yaml_says_of_it(tmp_path: Path) -> None:
    result, _ = joint(board_rig(), 8)
    calibration, assessment = calibrate(result, Acceptance(), PROVENANCE)
    assert assessment.verdict == "accepted"
    path = tmp_path / "calibration.yaml"
    path.write_text(render(calibration))
    assert load_calibration(path) == calibration
    names = calibration.laser_ranger.parameters.names
    assert names[-1] == "print_scale"
    assert not any("board" in name or "bow" in name for name in names)


def test_spots_beside_the_band_or_on_a_board_not_found() -> None:
    rig = board_rig()
    observations, views = BoardWorld(World(rig, 9)).measure(repeats=1)
    seen = {view.placement.key: view for view in views}
    kept = on_boards(rig.board, seen, observations)
    assert kept == observations
    # 12 mm from the band's middle at 300 mm: 533 / 300 x 12 = 21 px.
    beside = [replace(s, v_px=s.v_px + 40.0) for s in observations if s.placement == "B1"]
    assert all(isinstance(one, Rejected) for one in on_boards(rig.board, seen, beside))
    lost: dict[str, BoardView | Rejected] = {**seen, "B1": Rejected("B1", "dark")}
    found = on_boards(rig.board, lost, observations)
    of_b1 = {s.source for s in observations if s.placement == "B1"}
    assert {s.source for s in found if isinstance(s, Rejected)} == of_b1
    assert len(of_b1) == 4


def test_two_boards_at_one_placement_and_a_board_told_otherwise() -> None:
    rig = board_rig()
    observations, views = BoardWorld(World(rig, 1)).measure(repeats=1)
    with pytest.raises(BadInputError, match="one board"):
        fit(rig, observations, (), [*views, views[0]])
    moved = replace(views[0], placement=replace(views[0].placement, standoff_mm=250.0))
    with pytest.raises(BadInputError, match=r"\b250 mm"):
        fit(rig, observations, (), [moved])


def test_a_mirrored_picture_fits_no_pose() -> None:
    rig = board_rig()
    observations: list[Observation]
    observations, views = BoardWorld(World(rig, 1)).measure(repeats=1)
    corners = views[1].corners
    position_px = np.array([639.0, 0.0]) + np.array([-1.0, 1.0]) * corners.position_px
    mirrored = replace(corners, position_px=position_px)
    with pytest.raises(BadInputError, match="mirrored"):
        fit(rig, observations, (), [replace(views[1], corners=mirrored)])


@pytest.mark.parametrize("seed", SEEDS)
def test_terms_are_weighed_with_the_board_as_well(seed: int) -> None:
    """With a board k1 and k2 are known to a thousandth: what is there is shown."""
    rig = board_rig()
    world = World(rig, seed)
    observations, views = BoardWorld(world).measure()
    fitted = fit_calibration(rig, [*observations, *world.observations(FAR_MM)], (), views)
    terms = {term.name: term for term in fitted.terms}
    assert terms["k1"].verdict == "shown"
    assert set(terms) == {"k2", "k1", "ruler_scale", "target_slope_x target_slope_y", "tilts"}


@pytest.mark.parametrize("seed", SEEDS[:2])
def test_a_board_left_out_is_ranged_by_all_lasers_together_alone(seed: int) -> None:
    """Its tilt is anything without its corners: one laser would be promised centimetres."""
    folds = {fold.placement: fold for fold in leave_each_out(joint(board_rig(), seed)[0])}
    assert {key for key, fold in folds.items() if not fold.lasers} == {f"B{n}" for n in range(7)}
    for key in ("B0", "B1", "B2"):
        assert abs(folds[key].z) < 4
        assert folds[key].sd_mm < 0.02 * folds[key].standoff_mm


@pytest.mark.thorough
@pytest.mark.parametrize("seed", SEEDS)
def test_views_of_a_board_held_anywhere_give_the_lens_of_a_fit_of_spots(seed: int) -> None:
    rig = thesis_rig().model_copy(update={"board": BOARD})
    world = World(rig, seed)
    # The corners scatter three times more than stated, as in photographs: the spots do not suffer.
    seen = views(6, seed, sd_px=0.15, stated_px=0.05, by=world.pixels)
    result = fit_calibration(rig, world.observations(), (), seen)
    f, sd, share, by = of(result, "f_px")
    assert abs(f - world.values["f_px"]) < 4 * sd
    assert sd < 1.0
    assert (share > 0.99, by) == (True, "data")
    assert result.rejected == ()
    calibration, assessment = calibrate(result, Acceptance(), PROVENANCE)
    assert assessment.faults == ()
    assert {one.placement for one in assessment.cross_validation}.isdisjoint({"V1", "V2"})
    assert calibration.laser_ranger.fit.verdict == "accepted"

    alone = fit_calibration(rig, world.observations())
    assert of(alone, "f_px")[1] > sd
    assert of(alone, "f_px")[2] < 0.5


def test_a_spot_on_a_board_of_others_is_rejected() -> None:
    (view,) = views(1, 1)
    spot = Observation("row 2", "L1", "V1", 500.0, 0, 300.0, 200.0)
    (rejected,) = on_boards(BOARD, {"V1": view}, [spot])
    assert isinstance(rejected, Rejected)
    assert "chessboard" in rejected.reason
