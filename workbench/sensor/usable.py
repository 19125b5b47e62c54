"""Checks before an existing calibration is used: accepted, and made with the sensor of the rig."""

from __future__ import annotations

from pathlib import Path

from workbench.model.calibration import Calibration, load_calibration
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig


def load_usable(path: Path) -> Calibration:
    """Read a calibration that was accepted, by its limits or with a reason.

    Raises:
        BadInputError: the file is wrong, or the calibration was refused.
    """
    calibration = load_calibration(path)
    summary = calibration.laser_ranger.fit
    if not summary.usable:
        raise BadInputError(
            f"{path}: laser_ranger.fit.verdict: expected an accepted calibration, got one refused because"
            f" {'; '.join(summary.reasons)}; to use it nevertheless, fit it again with --accept REASON"
        )
    return calibration


def check_same_sensor(rig: Rig, calibration: Calibration) -> None:
    """Refuse a calibration of another sensor than the rig's.

    Raises:
        BadInputError: image size, lens model, lasers, name or serial number differ.
    """
    ours, made = calibration.laser_ranger, calibration.laser_ranger.provenance
    size_px = calibration.image_width, calibration.image_height
    for what, of_rig, of_file in (
        ("rig", rig.rig, made.rig),
        ("serial", rig.serial, made.serial),
        ("image size", (rig.camera.width_px, rig.camera.height_px), size_px),
        ("lens", rig.camera.lens, calibration.distortion_model),
        ("list of lasers", list(rig.laser_ids), [laser.id for laser in ours.lasers]),
    ):
        if of_rig != of_file:
            raise BadInputError(
                f"calibration: {what}: expected that of this rig, {of_rig}, got {of_file}; calibrate this"
                " rig, or use its own calibration"
            )
