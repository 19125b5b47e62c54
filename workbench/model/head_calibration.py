"""Schema of the file of a calibrated scanning head, `head.yaml`, format 1 (docs/scanning.md)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.calibration import Noise, Parameters, Provenance
from workbench.model.lens import LensName, lens_parameters
from workbench.model.name import LaserId
from workbench.model.rig import MOST_PX, NonNegativeFloat
from workbench.model.yamlfile import FileModel

HEAD = (
    "axis_z_mm",
    "axis_slope_x",
    "axis_slope_z",
    "beam_offset_mm",
    "scale",
    "eccentricity_cos_rad",
    "eccentricity_sin_rad",
)
"""Names of a head's parameters beyond those of its laser's ray."""
RAY = ("x_mm", "y_mm", "tx", "ty")
Span = Annotated[tuple[float, ...], Field(min_length=2, max_length=2)]


class HeadFitSummary(FileModel):
    """Quality of the fit."""

    moves: int
    """Number of moves of the head whose spots were used."""
    rms_px: NonNegativeFloat
    chi2: NonNegativeFloat
    degrees_of_freedom: float
    noise_scale: Annotated[float, Field(ge=1)]
    warnings: tuple[str, ...] = ()


class ScanningHead(FileModel):
    """A calibrated head: camera, axis and encoder with their covariance."""

    format: Literal[1]
    laser: LaserId
    image_width: Annotated[int, Field(gt=0, le=MOST_PX)]
    image_height: Annotated[int, Field(gt=0, le=MOST_PX)]
    distortion_model: LensName
    reading_sd_deg: NonNegativeFloat
    """Noise of a reading of the encoder, 1 sigma."""
    noise: Noise
    parameters: Parameters
    readings_deg: Span
    """Smallest and largest reading of the calibration."""
    standoffs_mm: Span
    """Smallest and largest standoff of the calibration."""
    fit: HeadFitSummary
    provenance: Provenance

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that a point depends on: lens, offset, ray, head."""
        return (
            *lens_parameters(self.distortion_model),
            "offset_mm",
            *(f"{self.laser}.{name}" for name in RAY),
            *(f"head.{name}" for name in HEAD),
        )

    @model_validator(mode="after")
    def _has_every_parameter(self) -> ScanningHead:
        if missing := [name for name in self.names if name not in self.parameters.names]:
            raise ValueError(f"parameters.names: expected {missing[0]} among them")
        return self


class HeadCalibration(FileModel):
    """A file `head.yaml`."""

    kind_key = "scanning_head"

    scanning_head: ScanningHead
