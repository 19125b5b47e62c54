"""Another calibration of the sensor, whose errors a verification shows beside those of the session's."""

from __future__ import annotations

from pathlib import Path

from workbench.model.rig import Rig
from workbench.procedure.engine.context import Context
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.usable import check_same_sensor, load_usable
from workbench.session.files import write_record


def compared_sensor(context: Context, name: str, file: Path | None) -> CalibratedSensor | None:
    """Sensor of the other calibration; None without one. A resumed session reads the copy in its folder.

    Raises:
        BadInputError: the file is wrong, was refused, or belongs to another sensor.
        StoppedError: the disk is full or cannot be written.
    """
    if file is None:
        return None
    copy = context.session_dir / f"{name}-compared.yaml"
    sensor = _load(copy if copy.exists() else file, context.rig)
    if not copy.exists():
        write_record(copy, file.read_bytes())
    return sensor


def _load(file: Path, rig: Rig) -> CalibratedSensor:
    calibration = load_usable(file)
    check_same_sensor(rig, calibration)
    return CalibratedSensor(calibration)
