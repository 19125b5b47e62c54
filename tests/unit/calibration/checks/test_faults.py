"""Faults put into simulated calibrations are named, each by its own name, and sound ones name none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_world import PLACINGS, BoardWorld
from tests.support.corrupted_data import exchanged, mirrored, moved, shifted, stated_as, turned_at
from tests.support.message_text import laser_ids, numbers
from tests.support.rigs import World, board_rig, prior, thesis_rig
from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.checks.faults import find_faults
from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.data.observations import Observation, RejectedObservation
from workbench.calibration.selection.outliers import fit_without_outliers
from workbench.calibration.verdict.assessment import Assessment, assess
from workbench.model.acceptance import Acceptance
from workbench.model.fit_event import Fault, Rejected
from workbench.model.rig import Rig

RIG = thesis_rig()
SEEDS = (1, pytest.param(2, marks=pytest.mark.thorough))
SOUND = 20


def named(observations: list[Observation], rejected: Sequence[Rejected] = (), rig: Rig = RIG) -> list[Fault]:
    fit = fit_without_outliers(rig, observations, rejected)
    return list(find_faults(fit, leave_each_out(fit)))


def judged(observations: list[Observation]) -> Assessment:
    fit = fit_without_outliers(RIG, observations)
    return assess(fit, Acceptance(), 0.01, leave_each_out(fit))


def the(faults: list[Fault], name: str) -> str:
    assert [fault.name for fault in faults] == [name]
    return faults[0].message


@pytest.mark.parametrize("seed", SEEDS)
class TestFaults:
    @pytest.mark.long_cases
    @pytest.mark.parametrize(("a", "b"), [("L1", "L2"), ("L1", "L4")])
    def test_two_lasers_exchanged(self, seed: int, a: str, b: str) -> None:
        message = the(named(exchanged(World(RIG, seed).observations(), a, b)), "lasers_swapped")
        assert laser_ids(message) == [a, b]

    def test_a_mirrored_picture(self, seed: int) -> None:
        world = World(RIG, seed)
        the(named(mirrored(world, world.observations())), "mirrored")

    @pytest.mark.parametrize("turn_deg", [6.0, -8.0])
    def test_a_target_turned_at_one_placement_is_named_with_its_angle(
        self, seed: int, turn_deg: float
    ) -> None:
        world = World(RIG, seed)
        message = the(named(turned_at(world, 280.0, turn_deg)), "tilted")
        standoff_mm, angle_deg, *_ = numbers(message)
        assert standoff_mm == 280.0
        assert angle_deg == pytest.approx(turn_deg, abs=2.0)
        assert "vertical" in message

    @pytest.mark.long_cases
    @pytest.mark.parametrize(
        ("standoff_mm", "stated_mm", "slip"),
        [(600.0, 6000.0, "a digit too many"), (160.0, 1600.0, "too many"), (400.0, 40.0, "a digit too few")],
    )
    def test_a_standoff_mistyped(self, seed: int, standoff_mm: float, stated_mm: float, slip: str) -> None:
        message = the(named(stated_as(World(RIG, seed).observations(), standoff_mm, stated_mm)), "standoff")
        stated, fitted, *_ = numbers(message)
        assert stated == stated_mm
        assert slip in message
        assert fitted == pytest.approx(standoff_mm, abs=5 * RIG.bench.placement_sd_mm + 0.005 * standoff_mm)

    @pytest.mark.long_cases
    @pytest.mark.parametrize("standoff_mm", [125.0, 400.0, 900.0])
    def test_a_standoff_ten_millimetres_off(self, seed: int, standoff_mm: float) -> None:
        message = the(
            named(stated_as(World(RIG, seed).observations(), standoff_mm, standoff_mm + 10)), "standoff"
        )
        assert numbers(message)[0] == standoff_mm + 10

    @pytest.mark.long_cases
    @pytest.mark.parametrize(
        ("standoff_mm", "after", "step_mm"),
        [(160.0, 8, 2.0), (400.0, 12, -5.0), (600.0, 7, 8.0), (900.0, 4, 20.0)],
    )
    def test_a_target_that_moved(self, seed: int, standoff_mm: float, after: int, step_mm: float) -> None:
        world = World(RIG, seed)
        observations = moved(world, world.observations(), standoff_mm, after, step_mm)
        message = the(named(observations), "moved")
        of_it = [s.source for s in observations if s.standoff_mm == standoff_mm]
        at_mm, moved_mm, before, captures, *_ = numbers(message)
        assert (at_mm, before, captures) == (standoff_mm, after, len(of_it))
        assert moved_mm == pytest.approx(step_mm, rel=0.2)
        assert message.index(of_it[after - 1]) < message.index(of_it[after])

    @pytest.mark.long_cases
    @pytest.mark.parametrize("by_px", [2.0, -100.0])
    @pytest.mark.parametrize("repeats", [range(5), (1, 3), (1, 3, 4)])
    def test_a_reflection(self, seed: int, by_px: float, repeats: range | tuple[int, ...]) -> None:
        observations = shifted(World(RIG, seed).observations(), "L2", 600.0, by_px, repeats)
        fit = fit_without_outliers(RIG, observations)
        message = the(list(find_faults(fit, leave_each_out(fit))), "reflection")
        assert laser_ids(message) == ["L2"]
        assert numbers(message) == [600.0, len(repeats)]
        assert {r.source for r in fit.rejected} == {f"L2 600 {k}" for k in repeats}
        assert fit.noise_scale == 1.0

    def test_a_laser_that_never_lit(self, seed: int) -> None:
        observations = World(RIG, seed).observations()
        dark = [s for s in observations if s.laser_id == "L3"]
        missing = [
            RejectedObservation(s.source, "no spot", replace(s, u_px=np.nan, v_px=np.nan)) for s in dark
        ]
        message = the(named([s for s in observations if s not in dark], missing), "never_lit")
        assert laser_ids(message) == ["L3"]
        assert numbers(message) == [len(dark)]

    def test_spots_saturated(self, seed: int) -> None:
        observations = [replace(s, saturated=s.standoff_mm < 300) for s in World(RIG, seed).observations()]
        clipped = sum(s.saturated for s in observations)
        expected = [clipped, len(observations), 125.0, 160.0, 210.0, 280.0]
        assert numbers(the(named(observations), "saturated")) == expected

    def test_all_standoffs_far(self, seed: int) -> None:
        message = the(named(World(RIG, seed).observations((1400.0, 2200.0, 3200.0, 4500.0))), "all_far")
        assert numbers(message)[0] == 1400.0


@pytest.mark.long_cases
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("standoffs_mm", [(200.0,), (200.0, 200.0), (200.0, 230.0)])
def test_few_standoffs_that_are_near_are_not_called_far(seed: int, standoffs_mm: tuple[float, ...]) -> None:
    fit = fit_without_outliers(RIG, World(RIG, seed).observations(standoffs_mm))
    assert find_faults(fit, ()) == ()


def test_lasers_read_across_their_line_alone_are_not_called_far() -> None:
    observations = [replace(s, u_px=float("nan")) for s in World(RIG, 1).observations()]
    assert find_faults(fit_without_outliers(RIG, observations), ()) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("seed", SEEDS)
def test_two_standoffs_mistyped(seed: int) -> None:
    observations = stated_as(stated_as(World(RIG, seed).observations(), 600.0, 6000.0), 160.0, 170.0)
    faults = named(observations)
    assert {fault.name for fault in faults} == {"standoff"}
    assert {numbers(fault.message)[0] for fault in faults} == {6000.0, 170.0}


def test_a_camera_on_its_head_where_lasers_stand_above_and_below() -> None:
    upright = tuple(
        laser.model_copy(
            update={"axis": "v", "x_mm": prior(0.0, 0.2), "y_mm": prior(0.5 * laser.x_mm.value + 8, 0.2)}
        )
        for laser in RIG.lasers
    )
    rig = RIG.model_copy(update={"lasers": upright})
    observations = [replace(s, v_px=479 - s.v_px) for s in World(rig, 1).observations()]
    the(named(observations, rig=rig), "upside_down")


@pytest.mark.long_cases
@pytest.mark.parametrize(
    "spoil",
    [
        lambda world, s: exchanged(s, "L1", "L2"),
        mirrored,
        lambda world, s: stated_as(s, 600.0, 6000.0),
        lambda world, s: moved(world, s, 160.0, 8, 2.0),
    ],
)
def test_a_fault_that_spoils_everything_refuses(
    spoil: Callable[[World, list[Observation]], list[Observation]],
) -> None:
    world = World(RIG, 4)
    assessment = judged(spoil(world, world.observations()))
    assert assessment.verdict == "refused"
    assert assessment.reasons[0] == assessment.faults[0].message
    assert set(assessment.reasons) <= {fault.message for fault in assessment.faults}


def test_a_reflection_left_out_does_not_refuse() -> None:
    assessment = judged(shifted(World(RIG, 4).observations(), "L2", 600.0, 12.0))
    assert (assessment.verdict, [f.name for f in assessment.faults]) == ("accepted", ["reflection"])
    assert assessment.faults[0].message in assessment.warnings


def test_sound_calibrations_name_no_fault_and_lose_no_spot() -> None:
    """2000 are tried by `python -m tests.proofs.validation`."""
    for seed in range(700, 700 + SOUND):
        fit = fit_without_outliers(RIG, World(RIG, seed).observations())
        assert fit.rejected == ()
        assert find_faults(fit, ()) == ()


@pytest.mark.thorough
def test_noise_that_nobody_stated_rightly_is_no_fault() -> None:
    """Noise and speckle three times the stated: the fit scales its deviations, and nothing is named."""
    for seed in range(2):
        observations = World(thesis_rig(0.09, 0.12), seed).observations()
        fit = fit_without_outliers(RIG, observations)
        assert fit.noise_scale > 1.5
        assert fit.rejected == ()
        assert find_faults(fit, leave_each_out(fit)) == ()
        assert explain_misfit(fit) == ()
    assert np.isfinite(fit.values).all()


@pytest.mark.parametrize(("factor", "seed"), [(2, 4), (3, 2), (3, 6), (4, 1), (4, 3)])
def test_repeats_noisier_than_stated_are_no_fault(factor: int, seed: int) -> None:
    """Speckle is as stated: the fit's own scale stays 1, and the repeats' must serve every test."""
    observations = World(thesis_rig(0.03 * factor), seed).observations(repeats=10)
    fit = fit_without_outliers(RIG, observations)
    assert fit.cells.repeat_scale == pytest.approx(factor, rel=0.1)
    assert fit.noise_scale == 1.0
    assert find_faults(fit, leave_each_out(fit)) == ()


@pytest.mark.parametrize("seed", [1, 8, 9])
def test_one_spot_that_flickers_is_no_movement(seed: int) -> None:
    """Three times the noise of all others in the repeats of one spot: its own deviation is the measure."""
    rng = np.random.default_rng(seed)
    observations = [
        replace(s, u_px=s.u_px + rng.normal(0, 0.1), v_px=s.v_px + rng.normal(0, 0.1))
        if (s.laser_id, s.standoff_mm) == ("L2", 600.0)
        else s
        for s in World(RIG, seed).observations(repeats=8)
    ]
    fit = fit_without_outliers(RIG, observations)
    assert len(fit.cells.inconsistent) == 1
    assert find_faults(fit, leave_each_out(fit)) == ()


@pytest.mark.parametrize(
    ("u_px", "v_px", "agree"),
    [
        ((250.0, 250.01), (240.0, 240.01), True),
        ((250.0, 250.01), (np.nan, np.nan), True),
        ((250.0, 300.0), (np.nan, 240.0), False),
        ((250.0, np.nan), (np.nan, 240.0), False),
        ((np.nan, np.nan), (np.nan, np.nan), False),
        ((250.0, 300.0), (240.0, 240.01), False),
    ],
)
@pytest.mark.parametrize("seed", SEEDS)
def test_outliers_agree_only_where_they_were_measured(
    seed: int, u_px: tuple[float, ...], v_px: tuple[float, ...], agree: bool
) -> None:
    observations = World(RIG, seed).observations(repeats=2)
    template = next(s for s in observations if (s.laser_id, s.standoff_mm) == ("L2", 600.0))
    outliers = [replace(template, u_px=u, v_px=v) for u, v in zip(u_px, v_px, strict=True)]
    rejected = [RejectedObservation(s.source, "away", s) for s in outliers]
    fit = fit_without_outliers(RIG, observations, rejected)
    assert [fault.name for fault in find_faults(fit, ())] == ["reflection"] * agree


def without_v(world: World) -> list[Observation]:
    return [replace(s, v_px=float("nan")) for s in world.observations()]


ONE_LASER = RIG.model_copy(update={"lasers": RIG.lasers[:1]})
SHAPES: list[tuple[str, Rig, Rig, Callable[[World], list[Observation]]]] = [
    ("repeats noisier", RIG, thesis_rig(0.09), World.observations),
    ("speckle larger", RIG, thesis_rig(0.03, 0.12), World.observations),
    ("one laser", ONE_LASER, ONE_LASER, World.observations),
    ("u alone", RIG, RIG, without_v),
    ("one placement", RIG, RIG, lambda world: world.observations((400.0,))),
    ("two placements", RIG, RIG, lambda world: world.observations((200.0, 800.0))),
    ("one row", ONE_LASER, ONE_LASER, lambda world: world.observations((400.0,), repeats=1)),
]


@pytest.mark.long_cases
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("assumed", "true", "seen"), [shape[1:] for shape in SHAPES], ids=[n for n, *_ in SHAPES]
)
def test_sound_data_of_any_shape_are_judged_without_a_fault(
    seed: int, assumed: Rig, true: Rig, seen: Callable[[World], list[Observation]]
) -> None:
    observations = seen(World(true, seed))
    fitted = fit_without_outliers(assumed, observations)
    assessment = assess(fitted, Acceptance(), 0.001, leave_each_out(fitted))
    assert assessment.faults == ()
    few = len({s.standoff_mm for s in observations}) < Acceptance().min_standoffs
    assert (assessment.verdict == "refused") == few
    assert len(assessment.reasons) == (len(assumed.lasers) if few else 0)
    assert all(numbers(reason)[1] == Acceptance().min_standoffs for reason in assessment.reasons)


@pytest.mark.long_cases
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("off_mm", [0.0, 10.0])
def test_a_boards_standoff_mistyped(seed: int, off_mm: float) -> None:
    """Its corners and its spots agree with one another and contradict the ruler."""
    world = World(board_rig(), seed)
    observations, views = BoardWorld(world).measure(PLACINGS[:5])
    assumed = [
        replace(s, standoff_mm=s.standoff_mm + off_mm) if s.placement == "B1" else s for s in observations
    ] + world.observations((600.0, 1400.0))
    boards = [
        replace(view, placement=replace(view.placement, standoff_mm=view.placement.standoff_mm + off_mm))
        if view.placement.key == "B1"
        else view
        for view in views
    ]
    faults = find_faults(fit_without_outliers(world.rig, assumed, (), boards), ())
    if not off_mm:
        assert faults == ()
    else:
        stated, fitted, *_ = numbers(the(list(faults), "standoff"))
        assert stated == 310.0
        assert fitted == pytest.approx(300.0, abs=3.0)
