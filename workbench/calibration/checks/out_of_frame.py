"""Spots that were not seen because they lie outside the picture, by the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.calibration.data.observations import Rejected
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.optics.image import in_picture


def name_out_of_frame(rig: Rig, values: FloatArray, rejected: Sequence[Rejected]) -> tuple[Rejected, ...]:
    """Give the right reason to captures whose spot the fit puts outside the picture.

    Args:
        rig: size of the picture, and the lasers.
        values: (P,) fitted parameters, the sensor's first.
        rejected: captures left out; those without a `missing` observation stay as they are.
    """
    return tuple(_renamed(rig, values, r) for r in rejected)


def _renamed(rig: Rig, values: FloatArray, rejected: Rejected) -> Rejected:
    observation = rejected.missing
    if observation is None:
        return rejected
    layout = Layout(rig.camera.lens, len(rig.lasers))
    ray = layout.ray(rig.laser_ids.index(observation.laser_id))
    square = (0.0, 0.0, 0.0)  # no error of placement, no tilt
    inputs = (*values[layout.common], *values[ray], *square)
    u, v = (float(c) for c in predict_cell(layout.lens_name, inputs, observation.standoff_mm))
    width, height = rig.camera.width_px, rig.camera.height_px
    if in_picture((u, v), (width, height)):
        return rejected
    return replace(
        rejected,
        reason=f"laser {observation.laser_id} at {observation.standoff_mm:g} mm: its spot lies outside the"
        f" picture, at u = {u:.0f}, v = {v:.0f} px of {width} x {height}: too near for this laser",
    )
