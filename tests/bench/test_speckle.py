"""What speckle does to spots as they are found, against what the rig files say of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.devices.registry import open_bench
from workbench.model.rig import load_rig
from workbench.model.target import Placement
from workbench.spots import find_spots

RIGS = Path(__file__).parents[2] / "rigs"
PLACEMENTS = 60


@pytest.mark.parametrize(
    ("name", "standoff_mm"),
    [("thesis-emulated", 200.0), pytest.param("thesis-both-emulated", 700.0, marks=pytest.mark.thorough)],
)
def test_spots_scatter_by_speckle_as_the_rig_file_says(tmp_path: Path, name: str, standoff_mm: float) -> None:
    """Two frames of a placement share its speckle; whatever else they share is left out here."""
    rig = load_rig(RIGS / f"{name}.yaml")
    steady = {"placement_sd_mm": 0.0, "tilt_sd_deg": 0.0, "target_tilt_sd_deg": 0.0}
    still = rig.bench.model_copy(update=steady)
    rig = rig.model_copy(update={"bench": still})
    lasers = rig.laser_ids[:4]
    found = []
    with open_bench(rig, tmp_path / "s") as bench:
        for i in range(PLACEMENTS):
            bench.target.place(Placement(key=f"P{i}", standoff_mm=standoff_mm))
            for repeat in ("a", "b"):
                bench.mark(f"P{i}/{repeat}")
                with bench.lasers.lit(lasers, for_s=2.0):
                    on = bench.camera.grab().image
                off, speckle_sd_px = bench.camera.grab().image, rig.noise.speckle_sd_px
                spots = find_spots(on, off, expected=4, speckle_sd_px=speckle_sd_px).spots
                found.append([(s.u_px, s.v_px) for s in sorted(spots, key=lambda s: s.u_px)])
    places = np.reshape(found, (PLACEMENTS, 2, 4, 2))
    first, second = np.moveaxis(places - places.mean(axis=0), 1, 0)
    shared = np.sqrt((first * second).sum() / (PLACEMENTS - 1) / 8)
    print(f"{name}, {standoff_mm:g} mm: {shared:.4f} px")
    # 480 products: 3 % of the deviation, 1 sigma.
    assert shared == pytest.approx(rig.noise.speckle_sd_px, rel=0.13)
