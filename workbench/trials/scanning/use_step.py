"""Step `use_head`: use the calibration of a scanning head from an earlier session."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import field_validator

from workbench.model.errors import BadInputError
from workbench.model.head_calibration import HeadCalibration
from workbench.model.yamlfile import Document, include_content
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel

FILE = "file"


@register
class UseHeadStep(StepModel):
    """Use a file `head.yaml` that `calibrate_head` has written."""

    gives: ClassVar[str | None] = "head"
    step: Literal["use_head"]
    file: HeadCalibration
    """In a file: path of `head.yaml`, relative to it."""

    @classmethod
    def include_files(cls, document: Document) -> bool:
        """Replace the path of the head's file by its content."""
        return include_content(document, FILE, HeadCalibration, "head's file")

    @field_validator("file", mode="before")
    @classmethod
    def _is_included(cls, file: Any) -> Any:
        if isinstance(file, str):
            raise ValueError(f"expected the content of a head's calibration, got the path {file}")
        return file

    @property
    def title(self) -> str:
        """Session in which the head was calibrated."""
        return f"Use the head calibrated in {self.file.scanning_head.provenance.session}"

    @property
    def default_duration_s(self) -> float:
        """Nothing is computed."""
        return 0.0

    def run(self, context: Context, name: str) -> str:
        """Check that the head belongs to the rig.

        Raises:
            BadInputError: it is of another sensor.
        """
        made = self.file.scanning_head
        rig = context.rig
        size_px = (rig.camera.width_px, rig.camera.height_px)
        for what, of_rig, of_file in (
            ("rig", rig.rig, made.provenance.rig),
            ("serial", rig.serial, made.provenance.serial),
            ("laser", rig.head_laser.id, made.laser),
            ("image size", size_px, (made.image_width, made.image_height)),
            ("lens", rig.camera.lens, made.distortion_model),
        ):
            if of_rig != of_file:
                raise BadInputError(
                    f"step {name}: {what}: expected that of this rig, {of_rig}, got {of_file}; calibrate this"
                    " head, or use its own file"
                )
        context.head = self.file
        return f"calibrated {made.provenance.created}"
