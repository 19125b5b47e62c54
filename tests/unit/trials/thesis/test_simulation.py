"""The simulation around the thesis's chain: scenes, frames, our chain, the judgement of claims."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from workbench.emulator.spec import BeamSpec, LensSpec, SensorSpec, StreamSpec
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig, load_rig
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.spots import find_spots
from workbench.spots.threshold_centroid import thesis_centres
from workbench.trials.thesis import ThesisSimulationStep, camera, thesis_chain
from workbench.trials.thesis import scene as scenes
from workbench.trials.thesis.schema import ChainReadings, Claim, LineName, SceneSimulated, SimulatedScene
from workbench.trials.thesis.simulation import claim_rows, readings_csv, simulate, together
from workbench.trials.thesis.workbench_chain import Chain

ROOT = Path(__file__).parents[4]
ALL = np.ones(4, bool)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(ROOT / "rigs/thesis-simulated.yaml")


def scene(**changes: object) -> SimulatedScene:
    keys: dict[str, object] = {
        "name": "a",
        "source": "here",
        "set_mm": (100.0, 800.0),
        "claims": [{"quantity": "range"}],
    }
    return SimulatedScene.model_validate(keys | changes)


def simulated(one: SimulatedScene, thesis: ChainReadings, ours: ChainReadings) -> SceneSimulated:
    set_mm = (100.0, 200.0, 400.0, 800.0)
    return SceneSimulated(scene=one, set_mm=set_mm, true_mm=set_mm, thesis=thesis, ours=ours, noisy=ours)


def readings(
    closest: tuple[float | None, ...] = (100.0, 200.0, 400.0, 800.0),
    shape: tuple[str, ...] = ("flat",) * 4,
    angle: tuple[float | None, ...] = (None,) * 4,
) -> ChainReadings:
    return ChainReadings(closest_mm=closest, shape=shape, angle_deg=angle)


def test_the_camera_is_the_virtual_benchs() -> None:
    assert BeamSpec().exit_diameter_mm == scenes.BEAM_EXIT_MM
    assert BeamSpec().divergence_mrad == pytest.approx(1e3 * scenes.DIVERGENCE)
    assert LensSpec().blur_px == camera.BLUR_PX
    assert SensorSpec().full_well_e == camera.FULL_WELL_E
    assert SensorSpec().read_noise_e == camera.READ_NOISE_E
    assert SensorSpec().black_level == camera.BLACK_LEVEL
    assert StreamSpec().metered_peak == camera.METERED_PEAK


@pytest.mark.parametrize("name", ["horizontal", "vertical"])
@pytest.mark.parametrize("range_mm", [300.0, 1100.0, 4000.0])
def test_a_frame_has_its_light_where_the_beam_ends(rig: Rig, name: LineName, range_mm: float) -> None:
    line = scenes.line_of(rig, name)
    depths = np.full(4, range_mm)
    spots = line.spots_px(depths)
    on, off = camera.expose(line, depths, spots, np.arange(4) == 3, None)
    light = on.astype(float) - off
    along = light.sum(axis=0 if line.axis == "u" else 1)
    across = light.sum(axis=1 if line.axis == "u" else 0)
    # The brightest pixel is metered for a spot in its middle, as at 300 mm; between two it is less.
    brightest = 255 * camera.METERED_PEAK
    assert on.max() == round(brightest) if range_mm == 300 else 0.7 * brightest < on.max() <= brightest
    assert (along * np.arange(len(along))).sum() / along.sum() == pytest.approx(spots[3], abs=0.02)
    assert (across * np.arange(len(across))).sum() / across.sum() == pytest.approx(camera.BAND_PX / 2)
    variance = (along * (np.arange(len(along)) - spots[3]) ** 2).sum() / along.sum()
    beam = (1.5 + 1.6e-3 * range_mm) / 4 * 480 / range_mm
    # Beam and lens, and the pixel's own 1/12; rounding cuts the tails.
    assert variance == pytest.approx(beam**2 + camera.BLUR_PX**2 + 1 / 12, rel=0.05)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_dark_frames_have_the_read_noise(rig: Rig, seed: int) -> None:
    line, depths = scenes.line_of(rig, "horizontal"), np.full(4, 900.0)
    rng = np.random.default_rng(seed)
    _, off = camera.expose(line, depths, line.spots_px(depths), ALL, rng)
    expected = (225.0 * 255 / 40_000) ** 2 + 1 / 12
    assert off.var() == pytest.approx(expected, rel=4 * np.sqrt(2 / off.size))
    assert off.mean() == pytest.approx(255 * 0.03, abs=4 * np.sqrt(expected / off.size))


@pytest.mark.parametrize("name", ["horizontal", "vertical"])
def test_our_calibration_is_exact(rig: Rig, name: LineName) -> None:
    line = scenes.line_of(rig, name)
    sensor = Chain(line, False, (45.0, 5000.0)).ranger.sensor
    for range_mm in (60.0, 777.0, 4321.0):
        along = np.array([sensor.spot_px(i, np.array([range_mm]))[0] for i in line.ids])
        axis = 0 if line.axis == "u" else 1
        assert along[:, axis] == pytest.approx(line.spots_px(np.full(4, range_mm)), rel=1e-12)
        assert along[:, 1 - axis] == pytest.approx(camera.BAND_PX / 2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_our_chain_states_how_far_noise_moves_its_ranges(rig: Rig, seed: int) -> None:
    chain = Chain(scenes.line_of(rig, "horizontal"), True, (45.0, 5000.0))
    rng = np.random.default_rng(seed)
    pulls = []
    for range_mm in np.geomspace(150, 4000, 60).tolist():
        found = chain.read(np.full(4, range_mm), ALL, rng)
        assert found.closest_mm is not None
        assert found.sigma_mm is not None
        if found.shape == "flat":  # another shape's closest range is its lowest point
            pulls.append((found.closest_mm - range_mm) / found.sigma_mm)
    assert len(pulls) >= 56  # one in a hundred is rejected
    low, high = chi2.ppf(0.0005, len(pulls)), chi2.ppf(0.9995, len(pulls))
    assert low < np.square(pulls).sum() < high


@pytest.mark.parametrize(("noisy", "gain"), [(False, 8.0), (True, 1.3)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_on_the_same_frames_ours_is_nearer_than_the_thesiss(
    rig: Rig, seed: int, noisy: bool, gain: float
) -> None:
    """What is gained is not the better camera alone: root mean square errors of a flat, 400 to 2500 mm."""
    line = scenes.line_of(rig, "horizontal")
    ranger = Chain(line, noisy, (45.0, 5000.0)).ranger
    rng = np.random.default_rng(seed)
    errors = []
    for range_mm in np.linspace(400, 2500, 40).tolist():
        depths = np.full(4, range_mm)
        spots = line.spots_px(depths) + noisy * line.speckle_sd_px * rng.standard_normal(4)
        on, off = camera.expose(line, depths, spots, ALL, rng if noisy else None)
        centres = np.sort(thesis_centres(on, off, scanlines=ranger.scanlines[:1], expected=4)[:, 0])
        lasers = np.arange(4)
        ranges = thesis_chain.ranges_mm(line, lasers, centres)
        sigmas = thesis_chain.sigmas_mm(line, lasers, centres)
        theirs = thesis_chain.shape_of(line, lasers, ranges, sigmas).closest_mm
        ours = ranger.read_lit("a", find_spots(on, off, scanlines=ranger.scanlines, expected=4).spots).flat_mm
        assert theirs is not None
        assert ours is not None
        errors.append((theirs / range_mm - 1, ours / range_mm - 1))
    rms_theirs, rms_ours = np.sqrt(np.square(errors).mean(axis=0))
    assert rms_theirs > gain * rms_ours


def test_our_chain_stops_at_what_it_sees(rig: Rig) -> None:
    chain = Chain(scenes.line_of(rig, "vertical"), False, (60.0, 5000.0))
    rng = np.random.default_rng(1)
    assert chain.read(np.full(4, 500.0), ~ALL, rng).closest_mm is None
    one = chain.read(np.full(4, 500.0), np.arange(4) == 2, rng)
    assert one.shape == "unknown"
    assert one.closest_mm == pytest.approx(500, rel=1e-4)


@pytest.mark.parametrize(
    ("changes", "closest_mm"),
    [
        ({}, 300.0),
        ({"incline_deg": 30.0}, 300.0),
        ({"incline_deg": -30.0}, 300 - 120 * np.tan(np.pi / 6)),
        ({"coefficients": (0.0, 0.02), "shift_mm": 60.0}, 300.0),
        ({"coefficients": (0.0, 0.0, 0.0003), "shift_mm": 60.0}, 300 - 0.0003 * 60**3),
        ({"coefficients": (-16.4, 0.403, -0.003186, 0.0000073)}, 300 - 209.41),
    ],
)
def test_the_closest_point_is_sought_before_the_front(
    rig: Rig, changes: dict[str, object], closest_mm: float
) -> None:
    lines = [scenes.line_of(rig, "horizontal")]
    assert scenes.truth(scene(**changes), lines, 300.0).closest_mm == pytest.approx(closest_mm, abs=0.01)


def test_two_lines_are_averaged() -> None:
    near, far = scenes.Outcome(100.0, "flat"), scenes.Outcome(110.0, "incline", 3.0)
    both = together([near, far], [640, 480])
    assert both.closest_mm == pytest.approx((100 * 640 + 110 * 480) / 1120)
    assert together([scenes.Outcome(None, "none"), far], [640, 480]) == far
    assert together([scenes.Outcome(None, "none")] * 2, [640, 480]).closest_mm is None


@pytest.mark.parametrize(
    ("stated", "error", "kept"),
    [(0.05, 0.0549, True), (0.05, 0.0551, False), (0.002, 0.0024, True), (0.002, 0.0026, False)],
)
def test_an_error_is_held_to_the_digits_stated(stated: float, error: float, kept: bool) -> None:
    one = scene(claims=[Claim(quantity="range", stated=stated)])
    (row,) = claim_rows(simulated(one, readings((100.0, 200 * (1 + error), 400.0, None)), readings()))
    assert row.thesis == pytest.approx(error)
    assert row.reproduced is kept
    assert row.better


def test_two_wrong_shapes_in_a_row_end_the_span() -> None:
    one = scene(claims=[Claim(quantity="shape", stated=400.0)])
    flat, other = "flat", "round 2"
    ours = readings(shape=(flat, other, flat, flat))
    (row,) = claim_rows(simulated(one, readings(shape=(flat, other, other, flat)), ours))
    assert (row.thesis, row.ours) == (100.0, 800.0)
    assert (row.reproduced, row.better) == (False, True)
    (row,) = claim_rows(simulated(one, ours, readings(shape=(other, other, flat, flat))))
    assert (row.ours, row.better) == (0.0, False)


def test_an_incline_is_right_when_its_angle_is() -> None:
    one = scene(incline_deg=30.0, claims=[Claim(quantity="shape"), Claim(quantity="angle")])
    thesis = readings(shape=("incline",) * 3 + ("flat",), angle=(30.0, 37.0, 36.1, None))
    ours = readings(shape=("incline",) * 4, angle=(30.0, 35.9, 24.1, 30.0))
    shape, angle = claim_rows(simulated(one, thesis, ours))
    assert (shape.thesis, shape.ours) == (100.0, 800.0)
    assert angle.thesis == pytest.approx(1.0)
    assert angle.ours == pytest.approx(5.9 / 30)


def test_ranges_of_nothing_are_counted() -> None:
    one = scene(lost=(1, 2, 3, 4), claims=[Claim(quantity="readings", stated=0.0)])
    nothing = readings((None,) * 4, ("none",) * 4)
    (row,) = claim_rows(simulated(one, readings((None, None, 400.0, None)), nothing))
    assert (row.thesis, row.ours, row.reproduced, row.better) == (1.0, 0.0, False, True)


def test_a_simulation_is_the_same_again(rig: Rig) -> None:
    one = scene(lines=("horizontal", "vertical"))
    first, second = (simulate(one, rig, 3, np.random.default_rng(5)) for _ in range(2))
    assert first == second
    lines = readings_csv([first]).splitlines()
    assert len(lines) == 1 + 3
    assert lines[0].startswith("scene,set_mm,true_mm,thesis_closest_mm")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lost": (5,)}, "expected numbers from 1 to 4, got 5"),
        ({"incline_deg": 30.0, "coefficients": (1.0,)}, "incline_deg or coefficients, got both"),
        ({"set_mm": (500.0, 100.0)}, "nearest < farthest"),
        ({"lines": ("vertical", "vertical")}, "each once"),
    ],
)
def test_scenes_that_make_no_sense(rig: Rig, changes: dict[str, object], message: str) -> None:
    with pytest.raises((BadInputError, ValueError), match=message):
        simulate(scene(**changes), rig, 2, np.random.default_rng(1))


def test_a_rig_has_to_be_ideal(rig: Rig) -> None:
    bent = rig.camera.model_copy(update={"k1": rig.camera.f_px})
    with pytest.raises(BadInputError, match="set to 0: k1"):
        scenes.line_of(rig.model_copy(update={"camera": bent}), "horizontal")
    with pytest.raises(BadInputError, match="at least 2 lasers with axis: v"):
        scenes.line_of(load_rig(ROOT / "rigs/thesis-emulated.yaml"), "vertical")


def test_the_procedure_has_every_shape_seen_in_part_and_not_at_all_on_both_lines() -> None:
    (step,) = load_procedure(ROOT / "procedures/thesis-simulation.yaml").steps
    assert isinstance(step, ThesisSimulationStep)
    lost = {0: "all", 1: "some", 3: "some", 4: "none"}
    have = {(s.lines, s.shape.split()[0], lost[len(s.lost)]) for s in step.scenes}
    for line in ("horizontal", "vertical"):
        for shape in ("flat", "incline", "round"):
            assert {((line,), shape, seen) for seen in ("all", "some", "none")} <= have
