"""Schema of a camera calibration, format 1: ROS's camera_info with deviations, without lasers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.calibration import CameraInfo, Parameters, Provenance
from workbench.model.lens import COEFFICIENTS, PINHOLE
from workbench.model.rig import NonNegativeFloat
from workbench.model.yamlfile import FileModel


class ViewQuality(FileModel):
    """Residuals of one view of the board."""

    name: str
    corners: int
    rms_px: NonNegativeFloat
    suspect: bool
    """Whether its residuals are far larger than those of the other views."""


class CameraFitSummary(FileModel):
    """Quality, verdict and warnings of the fit."""

    rms_px: NonNegativeFloat
    """Root mean square residual of all corner coordinates."""
    noise_scale: Annotated[float, Field(ge=1)]
    """Factor on the stated deviations of the corners; every sd includes it."""
    verdict: Literal["accepted", "refused"]
    reasons: tuple[str, ...] = ()
    accepted_because: str = ""
    """Reason of a person for accepting a refused fit."""
    warnings: tuple[str, ...] = ()
    views: tuple[ViewQuality, ...]


class CameraBlock(FileModel):
    """The workbench's own part of the file."""

    format: Literal[1]
    parameters: Parameters
    """Of the lens, in the order of the lens model."""
    fit: CameraFitSummary
    provenance: Provenance


class CameraCalibration(CameraInfo):
    """A camera calibration file."""

    kind_key = "workbench_camera"

    workbench_camera: CameraBlock

    @model_validator(mode="after")
    def _parameters_are_of_the_lens(self) -> CameraCalibration:
        expected = (*PINHOLE, *COEFFICIENTS[self.distortion_model])
        if (names := self.workbench_camera.parameters.names) != expected:
            raise ValueError(
                f"workbench_camera.parameters.names: expected {', '.join(expected)}, got {', '.join(names)}"
            )
        return self
