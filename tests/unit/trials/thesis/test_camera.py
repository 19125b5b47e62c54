"""Frames of the thesis's scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.emulator.spec import BeamSpec, LensSpec, SensorSpec, StreamSpec
from workbench.model.rig import Rig, load_rig
from workbench.trials.thesis import camera
from workbench.trials.thesis import scene as scenes
from workbench.trials.thesis.schema import LineName

ROOT = Path(__file__).parents[4]
ALL = np.ones(4, bool)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(ROOT / "rigs/thesis-simulated.yaml")


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
