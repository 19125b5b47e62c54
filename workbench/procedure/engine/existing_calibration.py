"""Existing calibration that a session uses instead of a fit of its own."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.model.event import CalibrationLoaded
from workbench.model.rig import Rig
from workbench.procedure.engine.procedure_file import Procedure
from workbench.sensor.usable import check_same_sensor, load_usable
from workbench.session.files import write_record
from workbench.session.manifest import CalibrationEntry

COPY = "calibration.yaml"
"""Name of the copy in the session folder, under which an export step writes too."""
GIVES = "calibration"
"""Requirement of steps that an existing calibration meets."""
SECONDS_PER_DAY = 86400.0


@dataclass(frozen=True)
class ExistingCalibration:
    """A calibration file that belongs to the rig."""

    file: Path
    content: bytes
    calibration: Calibration

    @classmethod
    def load(cls, file: Path, rig: Rig) -> ExistingCalibration:
        """Read a calibration file and check that it is usable with the rig.

        Raises:
            BadInputError: the file is wrong, was refused, or belongs to another sensor.
        """
        calibration = load_usable(file)
        try:
            check_same_sensor(rig, calibration)
        except BadInputError as error:
            raise BadInputError(f"{file}: {error}") from None
        return cls(file.resolve(), file.read_bytes(), calibration)

    @classmethod
    def of_session(cls, session_dir: Path, entry: CalibrationEntry, rig: Rig) -> ExistingCalibration:
        """Read the copy in a session folder.

        Raises:
            BadInputError: the copy is missing or has changed, or belongs to another sensor.
        """
        copy = cls.load(session_dir / COPY, rig)
        if copy.entry.sha256 != entry.sha256:
            raise BadInputError(
                f"{session_dir / COPY}: expected the calibration with which the session began (sha256"
                f" {entry.sha256[:12]}...), got another; restore it from {entry.file}"
            )
        return cls(Path(entry.file), copy.content, copy.calibration)

    @property
    def entry(self) -> CalibrationEntry:
        """Entry of the session's manifest."""
        return CalibrationEntry(file=str(self.file), sha256=hashlib.sha256(self.content).hexdigest())

    def write_copy(self, session_dir: Path) -> None:
        """Write the copy into the session folder.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        write_record(session_dir / COPY, self.content)

    def loaded(self, now: str) -> CalibrationLoaded:
        """Event of its use at the time `now` (ISO 8601)."""
        made = self.calibration.laser_ranger.provenance.created
        return CalibrationLoaded(
            file=str(self.file), path=COPY, sha256=self.entry.sha256, made=made, age_days=_days(made, now)
        )

    def refuse_export(self, procedures: Sequence[Procedure], paths: Sequence[Path]) -> None:
        """Refuse procedures that give a calibration of their own.

        Raises:
            BadInputError: a step exports a calibration.
        """
        for path, procedure in zip(paths, procedures, strict=True):
            for index, step in enumerate(procedure.steps):
                if step.gives == GIVES:
                    raise BadInputError(
                        f"{path}: steps[{index}]: {step.step} gives a calibration of the session's own, got"
                        f" --calibration {self.file} too; leave out one of the two"
                    )


def _days(made: str, now: str) -> float | None:
    """Days between two times; None if one is no time or lacks the zone of the other."""
    try:
        return (datetime.fromisoformat(now) - datetime.fromisoformat(made)).total_seconds() / SECONDS_PER_DAY
    except (ValueError, TypeError):
        return None
