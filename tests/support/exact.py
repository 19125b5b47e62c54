"""The exact calibration of the noise-free bench that steps are tested on."""

from __future__ import annotations

import numpy as np

from tests.support.ideal import CX, F
from tests.support.running import CY_PX
from workbench.model.calibration import Calibration
from workbench.model.rig import Rig
from workbench.trials.thesis.scene import LaserLine
from workbench.trials.thesis.workbench_chain import exact_calibration


def calibration_of(rig: Rig) -> Calibration:
    """Lasers parallel to the optical axis, as `two_laser_rig` has them; the picture's size is the rig's."""
    baselines = np.array([laser.x_mm.value for laser in rig.lasers])
    line = LaserLine("u", rig.laser_ids, baselines, F, CX, rig.camera.width_px, speckle_sd_px=0.0)
    exact = exact_calibration(line, False, (100.0, 2000.0))
    matrix = exact.camera_matrix.model_copy(update={"data": (F, 0.0, CX, 0.0, F, CY_PX, 0.0, 0.0, 1.0)})
    return exact.model_copy(update={"image_height": rig.camera.height_px, "camera_matrix": matrix})
