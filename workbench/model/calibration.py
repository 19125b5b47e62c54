"""Schema of the calibration YAML, format 1: sensor parameters, their uncertainty, and provenance.

The top level has the keys of ROS's camera_info; the workbench's own keys are under `laser_ranger`.
docs/calibration-format.md describes the format for authors of other readers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workbench.model.arrays import FloatArray
from workbench.model.lens import COEFFICIENTS, LensName
from workbench.model.name import LaserId
from workbench.model.prior import LARGEST
from workbench.model.rig import MOST_PX, ImageAxis, NonNegativeFloat
from workbench.model.yamlfile import FileModel, load_yaml_model

DeterminedBy = Literal["data", "joint", "prior"]
TermVerdict = Literal["shown", "open", "unneeded", "called for", "below", "asked for", "absent", "idle"]
"""The last four were written by version 0.1.0, which dropped terms."""
TERM_VERDICTS: dict[TermVerdict, str] = {
    "shown": "the data show it",
    "open": "the data do not decide",
    "unneeded": "the data favour the model without it",
    "called for": "MISSING: the data require it",
    "below": "kept: a higher order is kept",
    "asked for": "kept: requested",
    "absent": "dropped: shown to be absent",
    "idle": "dropped: no range depends on it",
}
"""Verdict on a term of the model, in words."""
Vector3 = Annotated[tuple[float, ...], Field(min_length=3, max_length=3)]
AGREEMENT = 1e-9
"""Largest relative difference between two copies of one number in the file."""


class Matrix(FileModel):
    """Matrix in the notation of OpenCV and ROS, row by row."""

    rows: Annotated[int, Field(gt=0)]
    cols: Annotated[int, Field(gt=0)]
    dt: Literal["d"] = "d"
    data: tuple[float, ...]

    @model_validator(mode="after")
    def _is_full(self) -> Matrix:
        if len(self.data) != self.rows * self.cols:
            raise ValueError(f"expected {self.rows} x {self.cols} numbers, got {len(self.data)}")
        return self


class ReferencePlane(FileModel):
    """Plane from which ranges are measured."""

    offset_mm: float
    """Distance of the pinhole behind the plane: z = range + offset."""


class LaserRay(FileModel):
    """Laser ray: the points origin + z direction in the camera frame, z in mm."""

    id: LaserId
    axis: ImageAxis
    origin_mm: Vector3
    direction: Vector3

    @model_validator(mode="after")
    def _is_in_normal_form(self) -> LaserRay:
        if self.origin_mm[2] != 0:
            raise ValueError(f"origin_mm: expected [x, y, 0.0], got z = {self.origin_mm[2]!r}")
        if self.direction[2] != 1:
            raise ValueError(f"direction: expected [tx, ty, 1.0], got {self.direction[2]!r} at its end")
        return self


class Noise(FileModel):
    """Noise of spot centres that a ranger takes into account, pixels, 1 sigma."""

    spot_sd_px: Annotated[float, Field(gt=0, le=LARGEST)]
    """Standard deviation of a spot that states none of its own."""
    speckle_sd_px: NonNegativeFloat
    """Speckle noise of a spot that states none; repeats at the same placement do not average it out."""


class Parameters(FileModel):
    """Posterior of all parameters of the sensor, 1 sigma. Every list is in the order of `names`."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[float, ...]
    sd: tuple[NonNegativeFloat, ...]
    prior_sd: tuple[NonNegativeFloat, ...]
    data_share: tuple[Annotated[float, Field(ge=0, le=1)], ...]
    determined_by: tuple[DeterminedBy, ...]
    covariance: Matrix

    @model_validator(mode="after")
    def _fits_together(self) -> Parameters:
        count = len(self.names)
        for key in ("units", "values", "sd", "prior_sd", "data_share", "determined_by"):
            if (length := len(getattr(self, key))) != count:
                raise ValueError(f"{key}: expected one for each of {count} names, got {length}")
        if (self.covariance.rows, self.covariance.cols) != (count, count):
            raise ValueError(f"covariance: expected {count} x {count}")
        _check_covariance(self.covariance_array)
        return self

    @property
    def covariance_array(self) -> FloatArray:
        """Posterior covariance, (P, P)."""
        return np.array(self.covariance.data).reshape(self.covariance.rows, self.covariance.cols)


class Validity(FileModel):
    """Interval of standoffs that the calibration covers, and the stated uncertainty in it."""

    standoff_mm: Annotated[tuple[float, ...], Field(min_length=2, max_length=2)]
    max_relative_range_sd: NonNegativeFloat
    """Largest standard deviation of a range, over the range, of any laser within `standoff_mm`."""

    @model_validator(mode="after")
    def _is_a_span(self) -> Validity:
        nearest, farthest = self.standoff_mm
        if not 0 < nearest <= farthest:
            raise ValueError(f"standoff_mm: expected 0 < nearest <= farthest, got {list(self.standoff_mm)}")
        return self


class TermSummary(FileModel):
    """Comparison of the model with and without one term (its parameters fixed at the rig file's values)."""

    name: str
    """`k2`, `p1 p2`, `ruler_scale`, or `tilts` (of all placements together)."""
    verdict: TermVerdict
    p_value: float
    """Probability of such data if the term were absent; the term's prior is not used."""
    log10_bayes_factor: float
    """Bayes factor of the model with the term (and its prior) over the model without it."""
    range_shift_sd: float | None
    """Largest change of a range without the term, in standard deviations; null if the model lacks it."""


class CrossValidatedRange(FileModel):
    """Range of one placement of the calibration by the fit without it; mm, 1 sigma."""

    standoff_mm: float
    error_mm: float
    """Range by all spots of the placement - standoff."""
    sd_mm: NonNegativeFloat


class FitSummary(FileModel):
    """Quality, verdict and warnings of the fit."""

    rms_px: NonNegativeFloat
    observations: int
    rejected: int
    noise_scale: Annotated[float, Field(ge=1)]
    placement_scale: Annotated[float, Field(ge=1)] = 1.0
    noise_degrees_of_freedom: Annotated[float, Field(gt=0)] | None = None
    """Of the estimate of the spots' noise; null if it is as stated, and in files of earlier versions."""
    placement_degrees_of_freedom: Annotated[float, Field(gt=0)] | None = None
    """Of the estimate of the placements' deviations; null likewise."""
    verdict: Literal["accepted", "refused"]
    reasons: tuple[str, ...] = ()
    """Reasons for a refusal."""
    accepted_because: str = ""
    """Reason of a person for accepting a refused fit."""
    warnings: tuple[str, ...] = ()
    terms: tuple[TermSummary, ...] = ()
    cross_validation: tuple[CrossValidatedRange, ...] = ()
    """Empty in files of versions that did not write it."""

    @property
    def usable(self) -> bool:
        """Whether the fit was accepted, by its limits or by a person with a reason."""
        return self.verdict == "accepted" or bool(self.accepted_because)


class Provenance(FileModel):
    """Origin of the calibration."""

    session: str
    captures_sha256: str
    rig: str
    serial: str
    command: str
    version: str
    operator: str
    created: str


class LaserRanger(FileModel):
    """The workbench's own part of a calibration file: everything beyond the camera."""

    format: Literal[1]
    reference_plane: ReferencePlane
    lasers: Annotated[tuple[LaserRay, ...], Field(min_length=1)]
    noise: Noise
    parameters: Parameters
    validity: Validity
    fit: FitSummary
    provenance: Provenance


class CameraInfo(FileModel):
    """Camera of a calibration file, with the keys of ROS's camera_info."""

    image_width: Annotated[int, Field(gt=0, le=MOST_PX)]
    image_height: Annotated[int, Field(gt=0, le=MOST_PX)]
    camera_name: str
    camera_matrix: Matrix
    distortion_model: LensName
    distortion_coefficients: Matrix
    rectification_matrix: Matrix
    projection_matrix: Matrix


class Calibration(CameraInfo):
    """A calibration file."""

    kind_key = "laser_ranger"

    laser_ranger: LaserRanger

    @model_validator(mode="after")
    def _copies_agree(self) -> Calibration:
        parameters = self.laser_ranger.parameters
        stated = dict(zip(parameters.names, parameters.values, strict=True))
        for name, value in self.geometry().items():
            if name not in stated:
                raise ValueError(f"laser_ranger.parameters.names: expected {name} among them")
            if abs(stated[name] - value) > AGREEMENT * max(1.0, abs(value)):
                raise ValueError(
                    f"{name} is {value!r} in the camera's or laser's own key and {stated[name]!r} in"
                    " laser_ranger.parameters.values; expected the same number"
                )
        self._check_projection()
        return self

    def _check_projection(self) -> None:
        k, p = self.camera_matrix.data, self.projection_matrix.data
        if p != (*k[0:3], 0.0, *k[3:6], 0.0, *k[6:9], 0.0):
            raise ValueError("projection_matrix: expected the camera_matrix and a column of zeros")

    def geometry(self) -> dict[str, float]:
        """Numbers that a range depends on, by parameter name."""
        k, d = self.camera_matrix.data, self.distortion_coefficients.data
        coefficients = COEFFICIENTS[self.distortion_model]
        if len(k) != 9 or len(d) != len(coefficients):
            raise ValueError(
                f"expected a camera_matrix of 3 x 3 and {len(coefficients)} distortion_coefficients"
            )
        if k[0] != k[4]:
            raise ValueError(f"camera_matrix: expected square pixels (fx = fy), got {k[0]!r} and {k[4]!r}")
        lens = dict(zip(("f_px", "cx_px", "cy_px"), (k[0], k[2], k[5]), strict=True))
        distortion = dict(zip(coefficients, d, strict=True))
        rays = {
            f"{laser.id}.{name}": value
            for laser in self.laser_ranger.lasers
            for name, value in zip(
                ("x_mm", "y_mm", "tx", "ty"), (*laser.origin_mm[:2], *laser.direction[:2]), strict=True
            )
        }
        return lens | distortion | {"offset_mm": self.laser_ranger.reference_plane.offset_mm} | rays


def load_calibration(path: Path) -> Calibration:
    """Read a calibration file.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    return load_yaml_model(path, Calibration)


def _check_covariance(covariance: FloatArray) -> None:
    if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=0.0):
        raise ValueError("covariance: expected a symmetric matrix")
    if (np.diag(covariance) < 0).any():
        raise ValueError(f"covariance: expected no negative variance, got {np.diag(covariance).min():g}")
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0, scale, 1.0)
    smallest = float(np.linalg.eigvalsh(covariance / np.outer(safe, safe))[0])
    # Rounding puts the eigenvalue of a singular direction at about +-1e-15; a lower one is a wrong matrix.
    if smallest < -1e-9:
        raise ValueError(
            f"covariance: expected no negative eigenvalue of the correlation matrix, got {smallest:.3g}"
        )
