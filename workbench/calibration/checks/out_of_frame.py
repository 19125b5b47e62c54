"""Missing spots that the fit predicts outside the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.calibration.data.observations import RejectedObservation
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import FloatArray
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig
from workbench.optics.image import in_picture


def name_out_of_frame(rig: Rig, values: FloatArray, rejected: Sequence[Rejected]) -> tuple[Rejected, ...]:
    """Correct the reason of captures without a spot where the fit predicts it outside the image.

    Args:
        rig: size of the image, and the lasers.
        values: (P,) fitted parameters, the sensor's first.
        rejected: rejected captures; all but those of a laser without a spot are returned unchanged.
    """
    return tuple(
        _with_reason(rig, values, r) if isinstance(r, RejectedObservation) and not r.observation.seen else r
        for r in rejected
    )


def _with_reason(rig: Rig, values: FloatArray, rejected: RejectedObservation) -> Rejected:
    observation = rejected.observation
    layout = Layout(rig.camera.lens, len(rig.lasers))
    ray = layout.ray(rig.laser_ids.index(observation.laser_id))
    square = (0.0, 0.0, 0.0)  # placement error and slopes
    inputs = (*values[layout.common], *values[ray], *square)
    u, v = (float(c) for c in predict_cell(layout.lens_name, inputs, observation.standoff_mm))
    width, height = rig.camera.width_px, rig.camera.height_px
    if in_picture((u, v), (width, height)):
        return rejected
    return replace(
        rejected,
        reason=f"laser {observation.laser_id} at {observation.standoff_mm:g} mm: spot outside the image"
        f" (u = {u:.0f}, v = {v:.0f} px of {width} x {height}): the target is too near for this laser",
    )
