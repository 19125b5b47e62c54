"""The virtual bench as a whole: opened by name, repeatable by seed, true to its truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.ideal import moments
from tests.support.virtual_bench import THESIS, emulated_thesis, put, read_truth, shot
from workbench.devices.registry import open_bench as open_named_bench
from workbench.emulator import EmulatedBench, open_bench
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import SpotImage
from workbench.emulator.truth import draw_placement_error, draw_truth
from workbench.model.target import Placement


def test_the_rig_file_names_the_bench(tmp_path: Path) -> None:
    with open_named_bench(THESIS, tmp_path / "s") as bench:
        assert isinstance(bench, EmulatedBench)
        frame = bench.camera.grab()
    assert frame.image.shape == (480, 640)
    assert frame.image.dtype == np.uint8
    assert frame.time_ns > 1_600_000_000_000_000_000


def test_another_seed_is_another_bench(tmp_path: Path) -> None:
    images = []
    for seed in (1, 2):
        with open_bench(emulated_thesis(seed=seed), tmp_path / f"s{seed}") as bench:
            put(bench, 500.0)
            images.append(shot(bench, "k"))
    assert not np.array_equal(images[0], images[1])


@pytest.mark.parametrize("seed", [2001, 4, 12])
def test_a_whole_bench_shows_its_truth(tmp_path: Path, seed: int) -> None:
    """Centroids of on - off, laser by laser, against the written truth through a textbook lens."""
    misses = []
    with open_bench(emulated_thesis(seed=seed), tmp_path / "s") as bench:
        for standoff in (300.0, 800.0, 2500.0):
            put(bench, standoff, f"P{standoff}")
            truth = read_truth(tmp_path / "s.truth.yaml")
            for name in bench.lasers.ids:
                bench.mark(f"{standoff} {name}")
                with bench.lasers.lit([name], for_s=5.0):
                    on = bench.camera.grab().image.astype(np.float64)
                off = bench.camera.grab().image.astype(np.float64)
                u, v = _predicted(truth, name, standoff, f"P{standoff}")
                left, top = round(u) - 8, round(v) - 8
                window = np.maximum((on - off)[top : top + 17, left : left + 17] - 6.0, 0)
                centre, _ = moments(SpotImage(left, top, window.astype(np.float32)))
                misses.append(centre - [u, v])
    # Speckle's 0.04 px, and what a thresholded centroid adds.
    assert np.sqrt(np.mean(np.square(misses))) < 0.08
    assert np.abs(np.mean(misses, axis=0)).max() < 0.04


def _predicted(truth: Any, name: str, standoff: float, key: str) -> tuple[float, float]:
    laser, placed = truth["lasers"][name], truth["placements"][key]
    z0 = standoff * (1 + truth["ruler_scale"]) + placed["error_mm"] + truth["offset_mm"]
    turn = np.array([truth[f"target_{name}"] + placed[name] for name in ("yaw_deg", "pitch_deg")])
    slope = np.tan(np.radians(turn))
    start, direction = np.array([laser["x_mm"], laser["y_mm"]]), np.array([laser["tx"], laser["ty"]])
    z = (z0 + slope @ start) / (1 - slope @ direction)
    x, y = (start + z * direction) / z
    radial = 1 + truth["k1"] * (x * x + y * y) + truth["k2"] * (x * x + y * y) ** 2
    return (
        float(truth["cx_px"] + truth["f_px"] * x * radial),
        float(truth["cy_px"] + truth["f_px"] * y * radial),
    )


def test_truth_lies_beside_the_session(tmp_path: Path) -> None:
    session = tmp_path / "sessions" / "one"
    for keys in (("P1", 'odd: "key" #2'), ("P1", "P3")):  # the second time as after a stop
        with open_bench(THESIS, session) as bench:
            for key in keys:
                bench.target.place(Placement(key=key, standoff_mm=500.0))
    written = read_truth(session.parent / "one.truth.yaml")
    spec = emulator_spec(THESIS)
    truth = draw_truth(THESIS, spec)
    assert float(written["f_px"]) == truth.f_px
    assert float(written["lasers"]["L3"]["tx"]) == truth.lasers["L3"].tx
    assert set(written["placements"]) == {"P1", 'odd: "key" #2', "P3"}
    assert float(written["placements"]["P3"]["yaw_deg"]) == draw_placement_error(THESIS, spec, "P3").yaw_deg
    assert not session.exists()
    assert "np." not in (session.parent / "one.truth.yaml").read_text()
