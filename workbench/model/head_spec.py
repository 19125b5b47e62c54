"""Scanning head in a rig file."""

from __future__ import annotations

from typing import Annotated

from pydantic import field_validator

from workbench.model.bounds import within
from workbench.model.name import LaserId
from workbench.model.prior import Baseline, Scale, Slope, exactly
from workbench.model.yamlfile import FileModel

STEEPEST_DEG = 80.0
"""Largest angle of a turned beam to the optical axis; at 90 degrees the beam meets no target."""


class HeadSpec(FileModel):
    """Scanning head: one laser that turns about an axis beside the camera; its angle is read by an encoder.

    The laser's own entry states the axis: `x_mm`, `y_mm` its position at the height of the beam, `tx` the
    beam's direction where the encoder reads 0, `ty` its inclination.
    """

    laser: LaserId
    axis_z_mm: Baseline = exactly(0.0)
    """Depth of the axis in the camera frame."""
    axis_slope_x: Slope = exactly(0.0)
    """Tilt of the axis: x per y."""
    axis_slope_z: Slope = exactly(0.0)
    """Tilt of the axis: z per y."""
    beam_offset_mm: Baseline = exactly(0.0)
    """Distance at which the beam passes the axis, positive to the right of the axis."""
    scale: Scale = exactly(0.0)
    """Relative error of the encoder's scale: angle turned = angle read x (1 + scale)."""
    eccentricity_sd_deg: Annotated[float, within(0, 10, "degrees")] = 0.0
    """Error of an encoder with an eccentric disc, a (cos(reading) - 1) + b sin(reading): sd of a and of b."""
    reading_sd_deg: Annotated[float, within(0, 10, "degrees")] = 0.0
    """Noise of the encoder's reading and of the bearing, independent at every move."""
    reach_deg: tuple[float, float] = (-45.0, 45.0)
    """Smallest and largest reading that the head can be turned to."""

    @field_validator("reach_deg")
    @classmethod
    def _is_an_arc(cls, reach_deg: tuple[float, float]) -> tuple[float, float]:
        if not -STEEPEST_DEG <= reach_deg[0] < reach_deg[1] <= STEEPEST_DEG:
            raise ValueError(
                f"expected [smallest, largest] within {STEEPEST_DEG:g} deg of the laser's direction at 0, got"
                f" {list(reach_deg)}"
            )
        return reach_deg
