"""Truth of a virtual bench under the names of the calibration's parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.calibration.model.parameters import DRIFT
from workbench.model.rig import TARGET_TILT


def parameter_values(truth: Mapping[str, Any]) -> dict[str, float]:
    """Values of a truth file (or of `asdict(Truth)`) by the names of parameters; the image does not drift."""
    values = {name: value for name, value in truth.items() if isinstance(value, float)}
    tilt = np.tan(np.radians([truth["target_yaw_deg"], truth["target_pitch_deg"]])).tolist()
    values |= dict(zip(TARGET_TILT, tilt, strict=True)) | dict.fromkeys(DRIFT, 0.0)
    for laser_id, ray in truth["lasers"].items():
        values |= {f"{laser_id}.{name}": value for name, value in ray.items()}
    return values
