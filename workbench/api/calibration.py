"""Calibrations: fit, load, save, compare, and the uncertainty of their ranges."""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from workbench.api.arguments import millimetres_of, names_of, path_of, rig_of, words_of
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict import comparison
from workbench.calibration.verdict.export import accept_with_reason, calibrate, write_calibration
from workbench.calibration.verdict.records import fit_finished
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration as CalibrationFile
from workbench.model.calibration import Provenance
from workbench.model.calibration import load_calibration as load_calibration_file
from workbench.model.captures import CaptureRow, check_images, parse_captures, read_captures_file
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.nested import fix_parameters
from workbench.model.rig import Rig
from workbench.report.frames import DIFFERENCE_COLUMNS, PARAMETER_COLUMNS, UNCERTAINTY_COLUMNS, frame_of
from workbench.report.session_frames import cross_validation_frame, residuals_frame
from workbench.sensor.calibrated import CalibratedSensor
from workbench.session.caller import now, operator
from workbench.session.manifest import workbench_version


@dataclass(frozen=True)
class Calibration:
    """A calibrated sensor with its uncertainty.

    Examples:
        >>> import workbench as wb
        >>> calibration = wb.load_calibration("data/session-0.1.0/calibration.yaml")
        >>> calibration.verdict
        'accepted'
        >>> calibration.parameters.loc["f_px", ["unit", "determined_by"]].tolist()
        ['px', 'joint']
    """

    file: CalibrationFile
    """Contents of the calibration file (docs/calibration-format.md)."""
    residuals: pd.DataFrame = field(default_factory=lambda: residuals_frame(()), repr=False, compare=False)
    """Residuals of the fit, as in `Session.residuals`; empty for a calibration from a file."""
    cross_validation: pd.DataFrame = field(
        default_factory=lambda: cross_validation_frame(()), repr=False, compare=False
    )
    """Each placement ranged by the fit without it; empty for a calibration from a file."""

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """One row per parameter, by its name; `sd` and `prior_sd` are 1 sigma."""
        found = self.file.laser_ranger.parameters
        values = {
            "unit": found.units,
            "value": found.values,
            "sd": found.sd,
            "prior_sd": found.prior_sd,
            "data_share": found.data_share,
            "determined_by": found.determined_by,
        }
        return pd.DataFrame(values, index=self._names, columns=list(PARAMETER_COLUMNS))

    @cached_property
    def covariance(self) -> pd.DataFrame:
        """(P, P) posterior covariance of the parameters."""
        array = self.file.laser_ranger.parameters.covariance_array
        return pd.DataFrame(array, index=self._names, columns=self._names)

    @property
    def verdict(self) -> str:
        """`accepted` or `refused`."""
        return self.file.laser_ranger.fit.verdict

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reasons for a refusal."""
        return self.file.laser_ranger.fit.reasons

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the fit: null directions, parameters that rest on their priors, doubtful data."""
        return self.file.laser_ranger.fit.warnings

    def range_uncertainty(self, ranges_mm: float | Collection[float]) -> pd.DataFrame:
        """Standard uncertainty of a single range by each laser, for spots of typical noise.

        Args:
            ranges_mm: range from the reference plane, or several.

        Returns:
            One row per laser and range, 1 sigma, NaN where the spot is outside the image. `sd_mm` has three
            parts, whose squares add up: noise of the spot, its speckle, and the calibration.

        Raises:
            BadInputError: a range is no finite number.
        """
        at = np.array(millimetres_of("ranges_mm", ranges_mm))
        sensor = CalibratedSensor(self.file)
        rows = [
            dict(zip(UNCERTAINTY_COLUMNS, (laser_id, range_mm, *parts), strict=True))
            for laser_id in sensor.ids
            for range_mm, parts in zip(
                at.tolist(), self._uncertainty(sensor, laser_id, at).tolist(), strict=True
            )
        ]
        return frame_of(rows, UNCERTAINTY_COLUMNS)

    def _uncertainty(self, sensor: CalibratedSensor, laser_id: str, at: FloatArray) -> FloatArray:
        """(n, 4) 1 sigma at ranges (n,): total, by noise, by speckle, by the calibration."""
        found, noise = sensor.typical_ranges(laser_id, at), self.file.laser_ranger.noise
        own_px = np.array([noise.spot_sd_px, noise.speckle_sd_px])
        noise_mm, speckle_mm = found.spot_sd_mm * (own_px / np.hypot(*own_px))[:, None]
        calibration_mm = np.sqrt(np.maximum(found.sigma_mm**2 - found.spot_sd_mm**2, 0.0))
        parts = np.stack([found.sigma_mm, noise_mm, speckle_mm, calibration_mm], axis=1)
        return np.where(sensor.in_frame(laser_id, at)[:, None], parts, np.nan)

    def accept(self, reason: str) -> Calibration:
        """The calibration, accepted in spite of a refusal; the file records the reason.

        Raises:
            BadInputError: the reason is blank, or no text.
        """
        words = words_of("reason", reason, "a reason in words")
        return replace(self, file=accept_with_reason(self.file, words))

    def save(self, path: str | Path) -> None:
        """Write the calibration file.

        Raises:
            LimitFailedError: the calibration is refused, and was not accepted with a reason.
            BadInputError: the file cannot be written.
        """
        file = path_of("path", path, "the path of a file to write")
        if not self.file.laser_ranger.fit.usable:
            raise LimitFailedError(f"{file}: the calibration is refused: {'; '.join(self.reasons)}")
        write_calibration(file, self.file)

    @property
    def _names(self) -> pd.Index[str]:
        return pd.Index(self.file.laser_ranger.parameters.names, name="parameter")


@dataclass(frozen=True)
class CalibrationComparison:
    """Result of `compare`."""

    differences: pd.DataFrame
    """Range by B - range by A of the same spot, per laser and range; 1 sigma of both calibrations."""
    chi2: float
    degrees_of_freedom: int
    p_value: float
    """Probability of differences as large as these, if both calibrations describe the same sensor."""
    same: bool
    """Whether the calibrations agree within their uncertainty."""
    explanations: tuple[str, ...]
    """Parameters whose change alone explains the difference, the most probable first."""
    identical: bool
    """Whether both have the same numbers."""
    notes: tuple[str, ...]
    """Reservations about the verdict, such as different serial numbers."""


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration file.

    Raises:
        BadInputError: the file is missing or wrong.
    """
    return Calibration(load_calibration_file(path_of("path", path, "the path of a calibration file")))


def calibration_of(name: str, given: object) -> Calibration:
    """The calibration itself, or the contents of its file.

    Args:
        name: name of the argument, for messages.
        given: its value.

    Raises:
        BadInputError: it is no calibration, or the file is missing or wrong.
    """
    if isinstance(given, Calibration):
        return given
    return Calibration(load_calibration_file(path_of(name, given, "a calibration, or the path of its file")))


def fit(
    captures: str | Path | pd.DataFrame, rig: str | Path | Rig, fix: str | Collection[str] = ()
) -> Calibration:
    """Fit a calibration, as `workbench fit` does; the result may be refused (`Calibration.verdict`).

    Args:
        captures: a captures file, or a data frame with its columns (docs/captures-format.md).
        rig: a rig file, or its contents.
        fix: parameter, or several, that keep the values of the rig file.

    Raises:
        BadInputError: captures or rig are wrong, or no observation is left.
        LimitFailedError: the fit determines no range.
    """
    model = fix_parameters(rig_of(rig), names_of("fix", fix))
    content, rows = _rows(captures)
    observations, rejected, boards = observations_of_rows(model, rows)
    if not observations:
        raise BadInputError("captures: expected captures of the rig's lasers at known standoffs, found none")
    fitted = fit_calibration(model, observations, rejected, boards)
    calibration, assessment = calibrate(fitted, Acceptance(), _provenance(model, content))
    record = [fit_finished(fitted, assessment)]
    return Calibration(calibration, residuals_frame(record), cross_validation_frame(record))


def compare(a: Calibration | str | Path, b: Calibration | str | Path) -> CalibrationComparison:
    """Compare two calibrations of one sensor, or their files, over the ranges and lasers that both have.

    Examples:
        >>> import workbench as wb
        >>> calibration = wb.load_calibration("data/session-0.1.0/calibration.yaml")
        >>> wb.compare(calibration, calibration).identical
        True

    Raises:
        BadInputError: image size, lasers or standoffs differ.
    """
    found = comparison.compare(calibration_of("a", a).file, calibration_of("b", b).file)
    return CalibrationComparison(
        differences=frame_of(map(asdict, found.differences), DIFFERENCE_COLUMNS),
        chi2=found.chi2,
        degrees_of_freedom=found.degrees_of_freedom,
        p_value=found.probability,
        same=not found.moved,
        explanations=found.explanations,
        identical=found.identical,
        notes=found.notes,
    )


def _rows(captures: str | Path | pd.DataFrame) -> tuple[bytes, tuple[CaptureRow, ...]]:
    """Content of a captures file and its rows; the images exist."""
    if isinstance(captures, pd.DataFrame):
        path, content = Path("captures"), captures.to_csv(index=False).encode()
    else:
        path = path_of("captures", captures, "a data frame, or the path of a captures file")
        content = read_captures_file(path)
    rows = parse_captures(path, content)
    check_images(path, rows)
    return content, rows


def _provenance(rig: Rig, captures: bytes) -> Provenance:
    return Provenance(
        session="",
        captures_sha256=hashlib.sha256(captures).hexdigest(),
        rig=rig.rig,
        serial=rig.serial,
        command="workbench.fit",
        version=workbench_version(),
        operator=operator(),
        created=now(),
    )
