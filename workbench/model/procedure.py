"""The procedure file: typed steps that a technician can read and edit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.acceptance import Acceptance
from workbench.model.rig import NonNegativeFloat, PositiveFloat
from workbench.model.yamlfile import FileModel, load_yaml_model

Standoffs = Annotated[tuple[PositiveFloat, ...], Field(min_length=1)]


class MessageStep(FileModel):
    """Tell the technician something."""

    step: Literal["message"]
    text: str

    @property
    def title(self) -> str:
        """For the progress line."""
        return self.text


class CaptureGridStep(FileModel):
    """Fire each laser alone at each standoff, `repeats` pairs of frames each."""

    gives: ClassVar = "captures"
    step: Literal["capture_grid"]
    standoffs_mm: Standoffs
    repeats: Annotated[int, Field(ge=1)]

    @model_validator(mode="after")
    def _standoffs_differ(self) -> CaptureGridStep:
        if len(set(self.standoffs_mm)) != len(self.standoffs_mm):
            raise ValueError("standoffs_mm must differ: more pairs at one standoff are more `repeats`")
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Capture at {len(self.standoffs_mm)} standoffs, {self.repeats} pairs a laser"


class BoardPlacing(FileModel):
    """How the board is to stand: at a standoff, turned about the vertical and the horizontal."""

    standoff_mm: PositiveFloat
    yaw_deg: Annotated[float, Field(gt=-90, lt=90)] = 0.0
    """Positive moves its right side away."""
    pitch_deg: Annotated[float, Field(gt=-90, lt=90)] = 0.0
    """Positive moves its lower side away."""
    standoff_sd_mm: NonNegativeFloat | None = None
    """How well the ruler tells the standoff of a board that is tilted by hand; the rig's if not stated."""


class CaptureBoardStep(FileModel):
    """At each placing of the printed board: `frames` in room light, then `repeats` pairs of each laser."""

    gives: ClassVar = "captures"
    step: Literal["capture_board"]
    placings: Annotated[tuple[BoardPlacing, ...], Field(min_length=1)]
    frames: Annotated[int, Field(ge=1)]
    repeats: Annotated[int, Field(ge=1)]

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Capture the board in {len(self.placings)} placings"


class FitStep(FileModel):
    """Fit the calibration to the captures so far; the session ends with exit code 3 where a limit fails."""

    needs: ClassVar = "captures"
    gives: ClassVar = "fit"
    step: Literal["fit"]
    limits: Acceptance = Acceptance()

    @property
    def title(self) -> str:
        """For the progress line."""
        return "Fit the calibration"


class ExportStep(FileModel):
    """Write the calibration to the session folder."""

    needs: ClassVar = "fit"
    gives: ClassVar = "calibration"
    step: Literal["export"]
    file: Annotated[str, Field(pattern=r"^calibration[A-Za-z0-9_.-]*\.yaml$")] = "calibration.yaml"

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Export {self.file}"


class AccuracyTrialStep(FileModel):
    """Range a flat at standoffs that the fit did not see."""

    needs: ClassVar = "calibration"
    step: Literal["accuracy_trial"]
    standoffs_mm: Standoffs
    readings: Annotated[int, Field(ge=1)]

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Accuracy at {len(self.standoffs_mm)} standoffs, {self.readings} readings each"


Step = Annotated[
    MessageStep | CaptureGridStep | CaptureBoardStep | FitStep | ExportStep | AccuracyTrialStep,
    Field(discriminator="step"),
]


class Procedure(FileModel):
    """A procedure file, format 1."""

    format: Literal[1]
    procedure: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    title: str
    steps: Annotated[tuple[Step, ...], Field(min_length=1)]


def load_procedure(path: Path) -> Procedure:
    """Read a procedure file.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    return load_yaml_model(path, Procedure)
