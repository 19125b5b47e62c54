"""Frames through the plain protocol: the same key gives the same bits, and no faults but those asked for."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.ideal import exact, ideal_rig, laser, moments
from tests.support.virtual_bench import emulated_thesis, put, shot
from workbench.emulator import open_bench
from workbench.emulator.spot import SpotImage
from workbench.model.arrays import FloatArray, Image


def brightness(image: Image) -> int:
    return int(np.sum(image > 100))


def test_same_key_same_bits(tmp_path: Path) -> None:
    def run(name: str, keys: list[str]) -> dict[str, Image]:
        with open_bench(emulated_thesis(), tmp_path / name) as bench:
            put(bench, 500.0)
            return {key: shot(bench, key) for key in keys}

    first, again = run("a", ["1", "2", "3"]), run("b", ["3", "2"])
    assert np.array_equal(first["2"], again["2"])
    assert np.array_equal(first["3"], again["3"])
    assert not np.array_equal(first["1"], first["2"])


def test_frames_of_one_key_differ(tmp_path: Path) -> None:
    with open_bench(emulated_thesis(), tmp_path / "s") as bench:
        bench.mark("k")
        a, b = bench.camera.grab().image, bench.camera.grab().image
        bench.mark("k")
        assert np.array_equal(bench.camera.grab().image, a)
    assert not np.array_equal(a, b)


@pytest.mark.parametrize("standoff", [125.0, 500.0, 2000.0, 5000.0])
@pytest.mark.parametrize("seed", [2001, 7])
def test_spots_are_bright_and_not_saturated(tmp_path: Path, standoff: float, seed: int) -> None:
    with open_bench(emulated_thesis(seed=seed), tmp_path / "s") as bench:
        put(bench, standoff)
        peak = int(shot(bench, "k").max())
        dark = bench.camera.grab().image
    assert peak == pytest.approx(0.7 * 255, abs=12)
    assert float(dark.mean()) < 15


def test_exposure_and_gain_hold_from_the_next_frame(tmp_path: Path) -> None:
    with open_bench(ideal_rig(camera={"bits": 16}), tmp_path / "s") as bench:
        put(bench, 1000.0)
        fluxes = []
        for exposure, gain in ((1e-4, 1.0), (2e-4, 1.0), (1e-4, 1.5)):
            bench.camera.exposure_s, bench.camera.gain = exposure, gain
            image = shot(bench, "k").astype(float)
            fluxes.append((image - np.median(image)).sum())
    assert fluxes[1] / fluxes[0] == pytest.approx(2.0, rel=0.01)
    assert fluxes[2] / fluxes[0] == pytest.approx(1.5, rel=0.01)


def test_metering_has_limits(tmp_path: Path) -> None:
    camera = {"shortest_exposure_s": 1e-3, "longest_exposure_s": 2e-3}
    with open_bench(emulated_thesis(camera=camera), tmp_path / "s") as bench:
        put(bench, 200.0, "near")
        assert bench.camera.meter() == 1e-3
        put(bench, 5000.0, "far")
        assert bench.camera.meter() == 2e-3


def test_frames_show_the_lasers_after_the_latency(tmp_path: Path) -> None:
    with open_bench(
        emulated_thesis(camera={"latency_frames": 3, "exposure_s": 7e-5}), tmp_path / "s"
    ) as bench:
        put(bench, 500.0)
        with bench.lasers.lit(["L1"], for_s=5.0):
            seen = [brightness(bench.camera.read().image) > 0 for _ in range(5)]
        after = [brightness(bench.camera.read().image) > 0 for _ in range(5)]
        assert seen == [False, False, False, True, True]
        assert after == [True, True, True, False, False]


def test_grab_discards_stale_frames(tmp_path: Path) -> None:
    with open_bench(emulated_thesis(camera={"latency_frames": 2}), tmp_path / "s") as bench:
        put(bench, 500.0)
        with bench.lasers.lit(["L1"], for_s=5.0):
            assert brightness(bench.camera.grab().image) > 0
        assert brightness(bench.camera.grab().image) == 0
        bench.camera.discard_frames = 1  # a driver that believes in less latency than there is
        with bench.lasers.lit(["L1"], for_s=5.0):
            assert brightness(bench.camera.grab().image) == 0


def test_latency_does_not_change_the_bits_of_a_capture(tmp_path: Path) -> None:
    images = []
    for run in range(2):
        with open_bench(emulated_thesis(camera={"latency_frames": 2}), tmp_path / f"s{run}") as bench:
            put(bench, 500.0)
            images += [shot(bench, key) for key in ("a", "b")[run:]]
    assert np.array_equal(images[1], images[2])


def test_repeated_frames_come_again_whole(tmp_path: Path) -> None:
    with open_bench(emulated_thesis(camera={"repeated": 0.3}), tmp_path / "s") as bench:
        bench.mark("k")
        frames = [bench.camera.read().image for _ in range(60)]
    again = sum(np.array_equal(a, b) for a, b in pairwise(frames))
    assert 8 <= again <= 28


def test_dropped_frames_are_missing_from_the_stream(tmp_path: Path) -> None:
    def stream(name: str, dropped: float, count: int) -> list[bytes]:
        with open_bench(emulated_thesis(camera={"dropped": dropped}), tmp_path / name) as bench:
            bench.mark("k")
            return [bench.camera.read().image.tobytes() for _ in range(count)]

    whole, thinned = stream("a", 0.0, 40), stream("b", 0.4, 15)
    places = [whole.index(frame) for frame in thinned]
    assert places == sorted(set(places))
    assert places[-1] > 16


def test_mirrored_image_exchanges_left_and_right(tmp_path: Path) -> None:
    images = []
    for mirrored in (False, True):
        rig = emulated_thesis(camera={"mirrored": mirrored})
        with open_bench(rig, tmp_path / str(mirrored)) as bench:
            put(bench, 500.0)
            images.append(shot(bench, "k"))
    assert np.array_equal(images[0][:, ::-1], images[1])
    assert images[1].flags["C_CONTIGUOUS"]


def test_ambient_light_jumps_when_the_lasers_go_off(tmp_path: Path) -> None:
    ambient = {"level_e_per_s": 1e6, "flicker_depth": 0.0, "off_jump": 0.5}
    with open_bench(ideal_rig(laser("L1", 60.0), ambient=ambient), tmp_path / "s") as bench:
        bench.camera.exposure_s = 0.01
        with bench.lasers.lit(["L1"], for_s=5.0):
            on = bench.camera.grab().image.astype(float) - 0.03 * 255
        off = bench.camera.grab().image.astype(float) - 0.03 * 255
    assert off.mean() / on.mean() == pytest.approx(1.5, rel=0.01)


@pytest.mark.parametrize(("exposure", "share"), [(1e-4, 1.0), (1 / 240, 2 / np.pi), (1 / 120, 0.0)])
def test_mains_flicker_averages_over_the_exposure(tmp_path: Path, exposure: float, share: float) -> None:
    """1 + d cos(2 pi 120 t) over an exposure T has the amplitude d sinc(120 T), rms / sqrt 2."""
    ambient = {"level_e_per_s": 20_000 / exposure, "flicker_depth": 0.2}
    small = {"width_px": 160, "height_px": 120}
    rig = ideal_rig(camera={**small, "bits": 16, "cx_px": exact(79.5), "cy_px": exact(59.5)}, ambient=ambient)
    with open_bench(rig, tmp_path / "s") as bench:
        bench.camera.exposure_s = exposure
        means = np.array([bench.camera.grab().image.mean() for _ in range(250)]) - 0.03 * 65535
    assert means.std() / means.mean() == pytest.approx(0.2 * share / np.sqrt(2), rel=0.1, abs=3e-4)


def test_warm_up_moves_spots_outward_and_dies_away(tmp_path: Path) -> None:
    warm = {"f_relative": 0.01, "time_constant_frames": 20.0}
    with open_bench(ideal_rig(warm_up=warm, lens={"blur_px": 0.7}), tmp_path / "s") as bench:
        put(bench, 500.0)
        bench.camera.exposure_s = 1e-4
        places = []
        with bench.lasers.lit(["L1"], for_s=20.0):
            for frame in range(61):
                image = bench.camera.grab().image
                if frame in (0, 20, 60):
                    places.append(_centre(image))
    warm_px = 533.3 * 60 / 500
    drift = np.array(places) - 319.5 - warm_px
    assert drift == pytest.approx(0.01 * warm_px * np.exp([0, -1, -3]), abs=0.05)


def test_the_image_drifts_by_the_frames_since_the_bench_was_opened(tmp_path: Path) -> None:
    drift = {"u_px_per_frame": 0.05, "v_px_per_frame": -0.02}
    with open_bench(ideal_rig(drift=drift, lens={"blur_px": 0.7}), tmp_path / "s") as bench:
        put(bench, 500.0)
        bench.camera.exposure_s = 1e-4
        places = []
        with bench.lasers.lit(["L1"], for_s=20.0):
            for frame in range(61):
                if frame == 30:
                    bench.mark("another capture")
                image = bench.camera.grab().image
                if frame in (0, 20, 60):
                    places.append(_centre_uv(image))
    square = np.array([319.5 + 533.3 * 60 / 500, 239.5])
    expected = square + np.outer([0, 20, 60], [0.05, -0.02])
    np.testing.assert_allclose(places, expected, rtol=0, atol=0.05)


def _centre(image: NDArray[Any]) -> float:
    return float(_centre_uv(image)[0])


def _centre_uv(image: NDArray[Any]) -> FloatArray:
    signal = np.maximum(image.astype(np.float64) - 0.03 * 255 - 2, 0).astype(np.float32)
    return moments(SpotImage(0, 0, signal))[0]


def test_a_stuck_beam_shows_in_a_dark_frame(tmp_path: Path) -> None:
    with open_bench(emulated_thesis(), tmp_path / "s") as bench:
        put(bench, 500.0)
        bench.controller.fault = "hides_stuck_beam"
        with bench.lasers.lit(["L1"], for_s=0.2):
            pass
        assert brightness(bench.camera.grab().image) > 0
        bench.controller.fault = "none"
