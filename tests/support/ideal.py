"""A rig without tolerances, on a bench without noise: what is left is geometry and light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from workbench.emulator.scene import BenchScene
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import SpotImage
from workbench.emulator.truth import draw_truth
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.model.target import FlatTarget, Placement, TargetShape

F, CX, CY = 533.3, 319.5, 239.5
FISHEYE = {"lens": "equidistant", "f_px": {"value": 305.6, "sd": 0.0}}
"""A camera of 120 degrees from the left edge to the right."""


def exact(value: float) -> dict[str, float]:
    return {"value": value, "sd": 0.0}


def laser(name: str, x_mm: float, y_mm: float = 0.0, tx: float = 0.0, ty: float = 0.0) -> dict[str, Any]:
    return {
        "id": name,
        "axis": "u" if x_mm else "v",
        "x_mm": exact(x_mm),
        "y_mm": exact(y_mm),
        "tx": exact(tx),
        "ty": exact(ty),
    }


def ideal_rig(
    *lasers: dict[str, Any], camera: dict[str, Any] | None = None, bench: Any = None, **emulator: Any
) -> Rig:
    """Without speckle, blur, read noise, hot pixels and ambient light, unless stated; nested keys merge."""
    block: dict[str, Any] = {
        "seed": 1,
        "beam": {"speckle_contrast": 0.0},
        "lens": {"blur_px": 0.0},
        "sensor": {"read_noise_e": 0.0, "hot_pixels": 0},
        "ambient": {"level_e_per_s": 0.0},
    }
    for key, value in emulator.items():
        block[key] = {**block.get(key, {}), **value} if isinstance(value, dict) else value
    default = {"width_px": 640, "height_px": 480, "f_px": exact(F), "cx_px": exact(CX), "cy_px": exact(CY)}
    default |= {"p1": exact(0.0), "p2": exact(0.0)}
    return Rig.model_validate(
        {
            "format": 1,
            "rig": "ideal",
            "driver": "emulated",
            "camera": {**default, **(camera or {})},
            "lasers": lasers or (laser("L1", 60.0),),
            "bench": {"target_tilt_sd_deg": 0.0, **(bench or {})},
            "emulator": block,
        }
    )


def scene_of(rig: Rig, folder: Path) -> BenchScene:
    spec = emulator_spec(rig)
    return BenchScene(rig, spec, draw_truth(rig, spec), folder / "truth.yaml")


def painted(rig: Rig, folder: Path, standoff_mm: float, target: TargetShape | None = None) -> SpotImage:
    """The only spot of the first laser."""
    scene = scene_of(rig, folder)
    scene.place(Placement(key="P", standoff_mm=standoff_mm, target=target or FlatTarget()))
    (spot,) = scene.spots(rig.laser_ids[0])
    return spot


def moments(spot: SpotImage) -> tuple[FloatArray, FloatArray]:
    """Centroid (u, v) px and variances (u, v) px^2."""
    rate = spot.rate.astype(np.float64)
    v, u = np.mgrid[: rate.shape[0], : rate.shape[1]]
    uv = np.stack([u + spot.left, v + spot.top]).reshape(2, -1).astype(np.float64)
    weights = rate.ravel() / rate.sum()
    mean = uv @ weights
    return mean, ((uv - mean[:, None]) ** 2) @ weights
