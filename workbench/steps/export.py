"""Step `export`: write the accepted calibration to the session folder."""

from __future__ import annotations

import hashlib
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from workbench.model.errors import BadInputError
from workbench.model.event import CalibrationExported
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.session.files import write_record


@register
class ExportStep(StepModel):
    """Write the accepted calibration to the session folder; later trials use it."""

    needs: ClassVar[str | None] = "fit"
    gives: ClassVar[str | None] = "calibration"
    step: Literal["export"]
    file: Annotated[str, Field(pattern=r"^calibration[A-Za-z0-9_.-]*\.yaml$")] = "calibration.yaml"

    @property
    def default_duration_s(self) -> float:
        """Time of writing a small file."""
        return 1.0

    @property
    def title(self) -> str:
        """Name of the file."""
        return f"Export {self.file}"

    def run(self, context: Context, name: str) -> str:
        """Write the file and journal its hash.

        Raises:
            BadInputError: no fit was accepted.
            StoppedError: the disk is full or cannot be written.
        """
        from workbench.calibration.verdict.export import render

        if context.accepted is None:
            raise BadInputError(f"step {name}: no calibration to export; expected a fit step before it")
        content = render(context.accepted).encode()
        write_record(context.session_dir / self.file, content)
        context.calibration = context.accepted
        sha256 = hashlib.sha256(content).hexdigest()
        context.emit(CalibrationExported(path=self.file, sha256=sha256))
        return f"{self.file} written"
