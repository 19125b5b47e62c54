"""Assignment, the ranger's answers, the captures file as scenes, and the control flow of a reading."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE, World, prior, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.ranging.acquire import NEXT, State, acquire
from workbench.ranging.assignment import assign, pair_up
from workbench.ranging.captures import read_captures, scenes
from workbench.ranging.lines import Axis
from workbench.ranging.ranger import Ranger
from workbench.ranging.search_band import band
from workbench.ranging.validity_checks import objections
from workbench.sensor.calibrated import CalibratedSensor
from workbench.spots import Failure, Finding, Scanline, Spot

IDS = ("L1", "L2", "L3", "L4")


@pytest.fixture(scope="module")
def ranger() -> Ranger:
    rig = thesis_rig()
    return Ranger(calibrate(fit(rig, World(rig, 1).observations()), Acceptance(), PROVENANCE)[0])


def positions(ranger: Ranger, ranges_mm: dict[str, float]) -> np.ndarray:
    return np.concatenate([ranger.sensor.spot_px(i, np.array([r])) for i, r in ranges_mm.items()])


def spots(ranger: Ranger, ranges_mm: dict[str, float]) -> list[Spot]:
    return [Spot(u, v, 0.03, 0.03, 1e4, 1.5, 150.0) for u, v in positions(ranger, ranges_mm).tolist()]


def dealt(ranger: Ranger, pixels: np.ndarray, sd_px: float = 0.05) -> tuple[str, ...] | None:
    """The lasers of the spots, in the order of the spots; None where they are not told."""
    pairs = pair_up(ranger.sensor, pixels, np.full(pixels.shape, sd_px))
    found = assign(pairs, np.arange(len(ranger.sensor.ids)))
    if found is None:
        return None
    by_spot = dict(zip(found[1].tolist(), found[0].tolist(), strict=True))
    return tuple(ranger.sensor.ids[by_spot[n]] for n in sorted(by_spot))


@pytest.mark.parametrize("range_mm", [150.0, 600.0, 2500.0, 4000.0])
def test_spots_of_a_flat_are_dealt_in_any_order(ranger: Ranger, range_mm: float) -> None:
    pixels = positions(ranger, dict.fromkeys(IDS, range_mm))
    for order in permutations(range(4)):
        expected = tuple(IDS[i] for i in order)
        assert dealt(ranger, pixels[list(order)]) == expected


@pytest.mark.parametrize("angle_deg", [-45.0, 30.0, 60.0])
def test_spots_of_an_incline_are_dealt(ranger: Ranger, angle_deg: float) -> None:
    slope = np.tan(np.radians(angle_deg))
    tilted = {i: 500.0 + slope * x for i, x in zip(IDS, (-60, -30, 30, 60), strict=True)}
    assert dealt(ranger, positions(ranger, tilted)) == IDS


def test_spots_that_fit_two_ways_are_not_dealt(ranger: Ranger) -> None:
    """Two spots in one place can be swapped at will."""
    pixels = positions(ranger, {"L1": 500.0, "L2": 500.0, "L3": 500.0, "L4": 500.0})
    pixels[1] = pixels[0]
    assert dealt(ranger, pixels) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_steps_in_depth_are_dealt_rightly_or_not_at_all(seed: int) -> None:
    """A post before a wall, and one laser of a flat on another surface: where a swap could deceive."""
    world = World(thesis_rig(), seed)
    ranger = Ranger(calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0])
    rng = np.random.default_rng(seed)
    right = wrong = 0
    for _ in range(150):
        depths = np.full(4, rng.uniform(300.0, 3000.0))
        depths[rng.integers(4)] *= rng.uniform(0.5, 2.0)
        at = zip(IDS, depths + world.values["offset_mm"], strict=True)
        pixels = np.array([world.pixel(i, z) for i, z in at]) + rng.normal(0.0, 0.05, (4, 2))
        told = dealt(ranger, pixels, 0.03)
        right += told == IDS
        wrong += told not in (None, IDS)
    assert wrong == 0
    assert right > 75


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("missing", [1, 2])
def test_missing_spots_leave_the_others_told(seed: int, missing: int) -> None:
    """Lasers aligned by eye do not share a line: that tells their spots apart, steps in depth included."""
    world = World(thesis_rig(), seed)
    ranger = Ranger(calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0])
    rng = np.random.default_rng([seed, missing])
    right = wrong = 0
    for _ in range(100):
        depths = np.full(4, rng.uniform(300.0, 3000.0))
        depths[rng.integers(4)] *= rng.uniform(0.5, 2.0)
        seen = np.sort(rng.permutation(4)[missing:])
        at = [world.pixel(IDS[n], depths[n] + world.values["offset_mm"]) for n in seen]
        told = dealt(ranger, np.array(at) + rng.normal(0.0, 0.05, (len(seen), 2)), 0.03)
        expected = tuple(IDS[n] for n in seen)
        right += told == expected
        wrong += told not in (None, expected)
    assert wrong == 0
    assert right >= 95


@pytest.fixture(scope="module")
def coplanar() -> Ranger:
    """Beams in one plane with the pinhole to a micrometre: every spot lies on the line of every laser."""
    rig = thesis_rig()
    level = {"y_mm": prior(0.0, 1e-3), "ty": prior(0.0, 1e-6)}
    rig = rig.model_copy(update={"lasers": tuple(laser.model_copy(update=level) for laser in rig.lasers)})
    return Ranger(calibrate(fit(rig, World(rig, 1).observations()), Acceptance(), PROVENANCE)[0])


def test_on_one_line_three_spots_of_a_flat_are_told_and_two_are_not(coplanar: Ranger) -> None:
    """The inner pair of a flat at 1 m is the outer pair of a flat at 2 m."""
    for gone in IDS:
        seen = [i for i in IDS if i != gone]
        assert dealt(coplanar, positions(coplanar, dict.fromkeys(seen, 900.0))) == tuple(seen)
    assert dealt(coplanar, positions(coplanar, {"L2": 1000.0, "L3": 1000.0})) is None
    assert dealt(coplanar, positions(coplanar, {"L2": 1000.0})) is None


def test_more_spots_than_lasers_are_not_dealt(coplanar: Ranger) -> None:
    flat = positions(coplanar, dict.fromkeys(IDS, 900.0))
    assert dealt(coplanar, np.vstack((flat, flat[:1] + np.array([9.0, 0.0])))) is None


def test_a_spot_on_no_laser_s_line_is_other_light(ranger: Ranger) -> None:
    astray = Spot(300.0, 60.0, 0.03, 0.03, 1e4, 1.5, 150.0)
    reading = ranger.read_lit("s", [*spots(ranger, dict.fromkeys(IDS, 800.0)), astray])
    assert reading.status == "done"
    assert reading.notes == ("1 of 5 spots on no laser's line: other light",)
    alone = ranger.read_lit("s", [astray])
    assert (alone.status, alone.closest_mm) == ("no_points", None)


def test_a_flat(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 800.0)))
    assert reading.status == "done"
    assert [laser.laser_id for laser in reading.lasers] == list(IDS)
    assert reading.closest_mm == pytest.approx(800.0)
    assert reading.flat_mm == pytest.approx(800.0)
    assert reading.flat_sigma_mm is not None
    assert reading.sigma_mm is not None
    assert reading.sigma_mm <= reading.flat_sigma_mm < min(laser.sigma_mm for laser in reading.lasers)
    (line,) = reading.lines
    assert (line.axis, line.shape.kind) == ("u", "flat")
    assert reading.mean_mm == reading.closest_mm


def test_the_closest_is_at_the_near_end_of_an_incline(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, {"L1": 520.0, "L2": 510.0, "L3": 490.0, "L4": 480.0}))
    (line,) = reading.lines
    assert line.shape.kind == "incline"
    # Beams that are not parallel shift the spots by some millimetres along the front.
    assert reading.closest_mm == pytest.approx(480.0, abs=1.5)
    assert line.shape.angle_rad == pytest.approx(-np.arctan(40 / 120), abs=0.01)


@pytest.mark.parametrize("angle_deg", [-60.0, 0.0, 60.0])
def test_the_mean_of_one_line_is_known_as_well_as_the_line(ranger: Ranger, angle_deg: float) -> None:
    """Pointing and baselines put the spots elsewhere along an incline, which moves its closest range."""
    at = zip(IDS, (-60.0, -30.0, 30.0, 60.0), strict=True)
    incline = {i: 600.0 + np.tan(np.radians(angle_deg)) * x for i, x in at}
    reading = ranger.read_known("s", 4, IDS, positions(ranger, incline), np.full((4, 2), 0.03))
    assert reading.lines[0].shape.kind == ("incline" if angle_deg else "flat")
    assert reading.mean_mm == reading.closest_mm
    assert reading.mean_sigma_mm == pytest.approx(reading.sigma_mm, rel=1e-4)


def test_the_mean_of_a_cylinder_s_line_is_known_as_well_as_the_line(ranger: Ranger) -> None:
    at = zip(IDS, (-60.0, -30.0, 30.0, 60.0), strict=True)
    tube = {i: 300.0 - np.sqrt(75.0**2 - (x - 4.0) ** 2) for i, x in at}
    reading = ranger.read_known("s", 4, IDS, positions(ranger, tube), np.full((4, 2), 0.03))
    assert reading.lines[0].shape.kind == "cylinder"
    assert reading.mean_sigma_mm == pytest.approx(reading.sigma_mm, rel=1e-4)


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_not_as_many_spots_as_lasers(coplanar: Ranger, count: int) -> None:
    ranger = coplanar
    flat = (
        spots(ranger, dict.fromkeys(IDS, 800.0))
        if count != 3
        else spots(ranger, {"L1": 800.0, "L2": 1300.0, "L3": 500.0, "L4": 800.0})
    )
    seen = (flat * 2)[:count]
    reading = ranger.read_lit("s", seen)
    assert reading.status == ("not_enough_points" if count else "no_points")
    assert reading.closest_mm is None
    assert reading.lasers == ()
    too_many = ["more spots than lasers: is this the calibration of this sensor?"] if count == 5 else []
    assert list(reading.notes[1:]) == too_many


@pytest.mark.parametrize("axis", ["u", "v"])
def test_one_band_holds_the_scanlines_of_a_line(axis: Axis) -> None:
    rng = np.random.default_rng(3)
    lines = []
    for along in (-200.0, -90.0, 100.0, 210.0):
        aside = rng.uniform(-4.0, 4.0, 2)
        far, near = (350.0, 240.0 + aside[0]), (350.0 + along, 240.0 + aside[1])
        if axis == "v":
            far, near = far[::-1], near[::-1]
        lines.append(Scanline(*far, near[0] - far[0], near[1] - far[1], 8.0))
    found = band(lines, axis)
    assert found.half_width_px < 8.0 + 8.0
    for line in lines:
        for share in (0.0, 0.5, 1.0):
            u, v = line.u0_px + share * line.du, line.v0_px + share * line.dv
            across = (u - found.u0_px) * found.dv - (v - found.v0_px) * found.du
            assert abs(across) / np.hypot(found.du, found.dv) <= found.half_width_px - 8.0 + 1e-9
    assert abs(found.du if axis == "u" else found.dv) == 1.0


def test_lasers_fired_alone_with_one_missing(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": 805.0})
    reading = ranger.read_known("s", 3, ["L1", "L4"], pixels, np.full((2, 2), np.nan))
    assert reading.status == "not_enough_points"
    assert reading.closest_mm == pytest.approx(800.0, abs=0.5)
    assert reading.lasers[0].range_mm == pytest.approx(800.0)


def test_a_laser_whose_spot_lies_beyond_infinity_does_not_count(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": np.inf}) - [[0.0, 0.0], [3.0, 0.0]]
    reading = ranger.read_known("s", 2, ["L1", "L4"], pixels, np.full((2, 2), 0.05))
    assert [laser.laser_id for laser in reading.lasers] == ["L1"]
    assert reading.status == "not_enough_points"
    assert reading.flat_mm == pytest.approx(800.0)


@pytest.mark.parametrize(
    ("u_px", "v_px", "why"),
    [
        (300.0, -5.0, "outside the picture"),
        (300.0, 481.0, "outside the picture"),
        (645.0, 240.0, "outside the picture"),
        (300.0, 300.0, "off the laser's line"),
    ],
)
def test_a_spot_that_cannot_be_the_laser_s_has_no_range(
    ranger: Ranger, u_px: float, v_px: float, why: str
) -> None:
    reading = ranger.read_known("s", 1, ["L1"], np.array([[u_px, v_px]]), np.full((1, 2), 0.05))
    assert (reading.status, reading.closest_mm, reading.lasers) == ("no_points", None, ())
    assert reading.notes[0].startswith("L1: ")
    assert why in reading.notes[0]


def test_a_spot_where_the_lens_model_folds_over_has_no_range(ranger: Ranger) -> None:
    folding = CalibratedSensor(ranger.calibration, {"k1": -0.45, "k2": 0.0, "k3": 0.0})
    (far,) = folding.spot_px("L4", np.array([np.inf]))
    beyond = np.array([[20.0, far[1]]])
    ranges = folding.ranges(["L1"], beyond, np.full((1, 2), 0.05))
    (why,) = objections(beyond, ranges, ranger.size_px)
    assert why is not None
    assert "folds over" in why


def test_a_spot_all_but_at_infinity_has_no_range(ranger: Ranger) -> None:
    spot = ranger.sensor.spot_px("L4", np.array([3e6]))
    reading = ranger.read_known("s", 1, ["L4"], spot, np.full((1, 2), 0.05))
    assert reading.status == "no_points"
    assert "mm only" in reading.notes[0] or "infinity" in reading.notes[0]


def test_a_range_beyond_the_calibrated_ones_is_marked(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4600.0)))
    assert reading.status == "done"
    assert reading.notes[0] == "L1: 4600 mm lies outside the calibrated 125 to 4500 mm"
    assert ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4400.0))).notes == ()
    near = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4500.2)))
    assert near.notes[0] == "L1: 4500.2 mm lies outside the calibrated 125 to 4500 mm"


@pytest.mark.parametrize(("range_mm", "end_mm"), [(7000.0, 4500.0), (110.0, 125.0)])
def test_how_far_a_spot_lies_outside_the_calibrated_field_is_told(
    ranger: Ranger, range_mm: float, end_mm: float
) -> None:
    lit = ("L2", "L3") if range_mm < end_mm else IDS  # the outer spots leave the picture
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(lit, range_mm)))
    outside = [note for note in reading.notes if "calibrated field" in note]
    assert len(reading.notes) - len(outside) == len(IDS) - len(lit)
    for laser_id, note in zip(lit, outside, strict=True):
        seen, end = ranger.sensor.spot_px(laser_id, np.array([range_mm, end_mm]))
        assert note.endswith(f", its spot {np.hypot(*(seen - end)):.1f} px outside the calibrated field")


def test_a_calibration_of_one_standoff_tells_how_far_its_spot_is(ranger: Ranger) -> None:
    part = ranger.calibration.laser_ranger
    one = part.validity.model_copy(update={"standoff_mm": (500.0, 500.0)})
    only = ranger.calibration.model_copy(update={"laser_ranger": part.model_copy(update={"validity": one})})
    reading = Ranger(only).read_lit("s", spots(ranger, dict.fromkeys(IDS, 800.0)))
    seen, there = ranger.sensor.spot_px("L1", np.array([800.0, 500.0]))
    assert f"its spot {np.hypot(*(seen - there)):.1f} px outside" in reading.notes[0]


@pytest.mark.parametrize(
    ("flag", "words"),
    [
        (Failure.SATURATED, "is saturated: its range is known less well"),
        (Failure.MERGED, "runs into another: both ranges err together"),
        (Failure.AT_EDGE, "is cut by the edge of the picture"),
    ],
)
def test_what_a_range_suffers_from_is_told(ranger: Ranger, flag: Failure, words: str) -> None:
    def shoot(ids: tuple[str, ...]) -> Finding:
        found = spots(ranger, dict.fromkeys(ids, 700.0))
        return Finding((replace(found[0], flags=frozenset({flag})), *found[1:]))

    reading = acquire(ranger, "s", shoot)
    assert (reading.status, reading.notes) == ("done", (f"L1: its spot {words}",))


def test_repeats_average_as_the_fit_averages_them(ranger: Ranger, tmp_path: Path) -> None:
    (spot,) = ranger.sensor.spot_px("L1", np.array([800.0])).tolist()
    one = captures(tmp_path, f"L1,,0,{spot[0]},{spot[1]},s")
    (single,) = read_captures(ranger, load_captures(one))
    many = captures(tmp_path, *(f"L1,,{n},{spot[0]},{spot[1]},s" for n in range(25)))
    (mean,) = read_captures(ranger, load_captures(many))
    assert single.sigma_mm is not None
    assert mean.sigma_mm is not None
    assert mean.sigma_mm < single.sigma_mm
    lacking = captures(tmp_path, f"L1,,0,{spot[0]},{spot[1]},s", f"L1,,1,{spot[0]},,s")
    (reading,) = read_captures(ranger, load_captures(lacking))
    assert reading.status == "done"
    assert reading.closest_mm == pytest.approx(800.0, rel=1e-6)


def test_repeats_that_disagree_widen_the_deviation(ranger: Ranger, tmp_path: Path) -> None:
    (spot,) = ranger.sensor.spot_px("L1", np.array([800.0])).tolist()
    path = captures(tmp_path, f"L1,,0,{spot[0] - 1},{spot[1]},s", f"L1,,1,{spot[0] + 1},{spot[1]},s")
    (reading,) = read_captures(ranger, load_captures(path))
    # The mean of two readings 2 px apart is known to about 1 px: r^2 / (f b) of it in range.
    assert reading.sigma_mm == pytest.approx(1.0 * 800.0**2 / (535.0 * 60.0), rel=0.4)


def test_normal_capture_is_enough_where_every_spot_shows(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    assert acquire(ranger, "s", shoot).status == "done"
    assert fired == [IDS]


def test_no_spot_asks_for_no_more(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(())

    assert acquire(ranger, "s", shoot).status == "no_points"
    assert fired == [IDS]


def test_spots_that_are_told_apart_ask_for_no_more(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(tuple(spots(ranger, dict.fromkeys(("L1", "L3", "L4"), 700.0))))

    reading = acquire(ranger, "s", shoot)
    assert fired == [IDS]
    assert reading.status == "not_enough_points"
    assert [laser.laser_id for laser in reading.lasers] == ["L1", "L3", "L4"]
    assert reading.notes == ("L2: no spot was seen",)


def test_a_spot_that_may_be_two_is_not_ranged_and_both_lasers_fire_alone(ranger: Ranger) -> None:
    """Far away the pointing of two beams puts their spots on one another: their sum is neither's."""
    crossing = moved_onto(ranger, "L1", "L2", 3000.0)
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        seen = [i for i in ids if len(ids) == 1 or i != "L1"]
        return Finding(tuple(spots(crossing, dict.fromkeys(seen, 3000.0))))

    reading = acquire(crossing, "s", shoot)
    assert fired == [IDS, ("L1",), ("L2",)]
    assert reading.status == "done"
    assert [laser.range_mm for laser in reading.lasers] == pytest.approx([3000.0] * 4)
    lit = crossing.read_lit("s", spots(crossing, dict.fromkeys(("L2", "L3", "L4"), 3000.0)))
    assert [laser.laser_id for laser in lit.lasers] == ["L3", "L4"]
    assert any(note.startswith("L1: its spot may be one with that at u = ") for note in lit.notes)


def moved_onto(ranger: Ranger, laser_id: str, other: str, range_mm: float) -> Ranger:
    """The sensor with one beam turned so that its spot lies on another's at a range, but for a pixel."""
    there, here = positions(ranger, {other: range_mm, laser_id: range_mm})
    values = ranger.calibration.geometry()
    turned = {
        f"{laser_id}.tx": values[f"{laser_id}.tx"] + (there[0] + 1.0 - here[0]) / values["f_px"],
        f"{laser_id}.ty": values[f"{laser_id}.ty"] + (there[1] - here[1]) / values["f_px"],
    }
    parameters = ranger.calibration.laser_ranger.parameters
    moved = tuple(turned.get(n, v) for n, v in zip(parameters.names, parameters.values, strict=True))
    part = ranger.calibration.laser_ranger
    parameters = parameters.model_copy(update={"values": moved})
    return Ranger(
        ranger.calibration.model_copy(
            update={"laser_ranger": part.model_copy(update={"parameters": parameters})}
        )
    )


def test_every_state_leads_to_an_answer() -> None:
    for state in (State.NORMAL, State.ALTERNATIVE):
        followers = {NEXT[s, seen] for s, seen in NEXT if s is state}
        assert State.ANSWER in followers
        assert state not in followers


def test_alternative_capture_fires_each_laser_alone(coplanar: Ranger) -> None:
    ranger = coplanar
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        if len(ids) > 1:
            return Finding(tuple(spots(ranger, dict.fromkeys(ids[:2], 700.0))))
        return Finding(() if ids == ("L2",) else tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    reading = acquire(ranger, "s", shoot)
    assert fired == [IDS, ("L1",), ("L2",), ("L3",), ("L4",)]
    assert reading.status == "not_enough_points"
    assert [laser.laser_id for laser in reading.lasers] == ["L1", "L3", "L4"]
    assert reading.flat_mm == pytest.approx(700.0)


@pytest.mark.parametrize(("alone", "words"), [(0, "no spots"), (2, "2 spots")])
def test_alternative_capture_that_tells_nothing_says_what_was_seen(
    coplanar: Ranger, alone: int, words: str
) -> None:
    astray = Spot(300.0, 60.0, 0.03, 0.03, 1e4, 1.5, 150.0)

    def shoot(ids: tuple[str, ...]) -> Finding:
        if len(ids) > 1:
            return Finding((*spots(coplanar, dict.fromkeys(ids[:2], 700.0)), astray))
        return Finding(tuple(spot for r in (700.0, 900.0)[:alone] for spot in spots(coplanar, {ids[0]: r})))

    reading = acquire(coplanar, "s", shoot)
    assert (reading.status, reading.closest_mm) == ("not_enough_points", None)
    assert "1 of 3 spots on no laser's line: other light" in reading.notes
    assert reading.notes[-4:] == tuple(f"{i}: fired alone, {words} on its line" for i in IDS)


def captures(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "c.csv"
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,u_px,v_px,scene", *rows]) + "\n")
    return path


def test_rows_that_share_a_scene_are_one(ranger: Ranger, tmp_path: Path) -> None:
    (one,) = positions(ranger, {"L1": 800.0}).tolist()
    (four,) = positions(ranger, {"L4": 800.0}).tolist()
    path = captures(
        tmp_path,
        f"L1,,0,{one[0] - 0.1},{one[1]},wall",
        f"L1,,1,{one[0] + 0.1},{one[1]},wall",
        f"L4,,0,{four[0]},,wall",
        f"L4,,0,{four[0]},,",
    )
    wall, single = read_captures(ranger, load_captures(path))
    assert (wall.scene, wall.status, single.scene) == ("wall", "done", "row 5")
    assert [laser.range_mm for laser in wall.lasers] == pytest.approx([800.0, 800.0], rel=1e-6)
    assert wall.lasers[1].v_px is None


def test_all_lasers_lit_are_a_scene_by_row(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text(
        "laser_id,standoff_mm,repeat,on,scene\nall,,0,a.png,s\nall,,1,b.png,s\nL1,,0,c.png,t\nL2,,0,d.png,t\n"
    )
    grouped = scenes(load_captures(path))
    assert {name: [row.row for row in rows] for name, rows in grouped.items()} == {
        "s": [2],
        "s (row 3)": [3],
        "t": [4, 5],
    }


def test_no_row_is_lost_where_lasers_lit_together_and_alone_share_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    rows = ["all,,0,a.png,s", "L1,,0,b.png,s", "all,,1,c.png,s (row 5)", "all,,2,d.png,s", "L2,,0,e.png,s"]
    rows += ["L3,,0,f.png,t", "all,,0,g.png,t", "L4,,0,h.png,t", "all,,0,i.png,s (row 5)"]
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,on,scene", *rows]) + "\n")
    grouped = scenes(load_captures(path))
    assert {name: [row.row for row in rows] for name, rows in grouped.items()} == {
        "s": [2],
        "s (fired alone)": [3, 6],
        "s (row 5)": [4],
        "s (row 5) (row 5)": [5],
        "t": [7, 9],
        "t (row 8)": [8],
        "s (row 5) (row 10)": [10],
    }


def test_a_laser_that_the_calibration_does_not_have(ranger: Ranger, tmp_path: Path) -> None:
    path = captures(tmp_path, "L9,,0,1,2,s")
    with pytest.raises(BadInputError, match="row 2, column laser_id: expected all or one of"):
        list(read_captures(ranger, load_captures(path)))


def test_angle_and_closest_range_lie_where_stated_whatever_the_calibration() -> None:
    """50 rigs, calibrated once each, before a wall turned by 30 degrees: pointing and lens are in sigma."""
    angle, closest = [], []
    for seed in range(300, 350):
        world = World(thesis_rig(), seed)
        ranger = Ranger(calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0])
        yaw, z0 = np.radians(30.0), 600.0 + world.values["offset_mm"]
        noise = np.random.default_rng([seed, 5]).normal(0.0, 0.05, (4, 2))  # 0.03 px and the speckle's 0.04
        pixels = np.array([world.pixel(i, z0, yaw) for i in IDS]) + noise
        reading = ranger.read_known("s", 4, IDS, pixels, np.full((4, 2), 0.03))
        shape = reading.lines[0].shape
        if shape.kind == "incline" and shape.angle_rad is not None and shape.angle_sigma_rad is not None:
            angle.append((shape.angle_rad - yaw) / shape.angle_sigma_rad)
            true = 600.0 + np.tan(yaw) * world.values["L1.x_mm"]
            closest.append((shape.closest_mm - true) / shape.closest_sigma_mm)
    assert len(angle) >= 46
    for z in (np.array(angle), np.array(closest)):
        # Of n standard normals the mean is known to 1 / sqrt(n), that of their squares to sqrt(2 / n).
        assert (z**2).mean() == pytest.approx(1.0, abs=3.5 * np.sqrt(2 / len(z)))
        assert abs(z.mean()) < 3.5 / np.sqrt(len(z))
