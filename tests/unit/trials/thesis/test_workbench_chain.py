"""The workbench's chain before the thesis's scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.same_frames import SameFrames
from workbench.model.rig import Rig, load_rig
from workbench.trials.thesis import camera
from workbench.trials.thesis import scene as scenes
from workbench.trials.thesis.schema import LineName
from workbench.trials.thesis.workbench_chain import Chain

ROOT = Path(__file__).parents[4]
ALL = np.ones(4, bool)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(ROOT / "rigs/thesis-simulated.yaml")


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
    frames = SameFrames(scenes.line_of(rig, "horizontal"), noisy, np.random.default_rng(seed))
    errors = []
    for range_mm in np.linspace(400, 2500, 40).tolist():
        theirs, ours = frames.read(range_mm)
        assert theirs is not None
        assert ours is not None
        assert ours.flat_mm is not None
        errors.append((theirs / range_mm - 1, ours.flat_mm / range_mm - 1))
    rms_theirs, rms_ours = np.sqrt(np.square(errors).mean(axis=0))
    assert rms_theirs > gain * rms_ours


def test_our_chain_stops_at_what_it_sees(rig: Rig) -> None:
    chain = Chain(scenes.line_of(rig, "vertical"), False, (60.0, 5000.0))
    rng = np.random.default_rng(1)
    assert chain.read(np.full(4, 500.0), ~ALL, rng).closest_mm is None
    one = chain.read(np.full(4, 500.0), np.arange(4) == 2, rng)
    assert one.shape == "unknown"
    assert one.closest_mm == pytest.approx(500, rel=1e-4)
