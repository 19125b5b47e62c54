"""The procedure file: typed steps that a technician can read and edit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal, TypeVar

from pydantic import Field, model_validator

from workbench.model.acceptance import Acceptance
from workbench.model.limit import Limit
from workbench.model.rig import LARGEST, NonNegativeFloat
from workbench.model.simulation import SimulatedScene
from workbench.model.yamlfile import FileModel, load_yaml_model

LimitedStep = TypeVar("LimitedStep", "CheckLimitsStep", "ValidateStep")
Standoff = Annotated[float, Field(gt=0, le=LARGEST)]
Standoffs = Annotated[tuple[Standoff, ...], Field(min_length=1)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
KEPT_FOR_ACTIONS = {"redo", "skip", "abort"}
"""Whoever types one of these does it, and chooses nothing."""


def _differ(standoffs_mm: tuple[float, ...], more: str) -> None:
    """Standoffs name frames, by 12 digits."""
    if len({f"{one:.12g}" for one in standoffs_mm}) != len(standoffs_mm):
        raise ValueError(f"standoffs_mm must differ: more at one standoff are more `{more}`")


class MessageStep(FileModel):
    """Tell the technician something."""

    step: Literal["message"]
    text: str

    @property
    def title(self) -> str:
        """For the progress line."""
        return self.text


class ConfirmStep(FileModel):
    """Have the technician do something, and wait until it is done."""

    step: Literal["confirm"]
    text: str
    expect: str = ""
    """What is to be seen when it is done."""
    otherwise: str = ""
    """What to do if it is not so."""

    @property
    def title(self) -> str:
        """For the progress line."""
        return self.text


class NumberAsked(FileModel):
    """A number to be read off."""

    unit: str
    within: Annotated[tuple[float, float], Field(alias="in")]
    usual: float | None = None

    @model_validator(mode="after")
    def _can_be_answered(self) -> NumberAsked:
        low, high = self.within
        if low > high:
            raise ValueError(f"`in`: expected [lowest, highest], got [{low:g}, {high:g}]")
        if self.usual is not None and not low <= self.usual <= high:
            raise ValueError(f"`usual`: expected {low:g} to {high:g}, as `in` says, got {self.usual:g}")
        return self


class AskStep(FileModel):
    """Ask for a number or for one of some choices; the answer is kept in the journal."""

    step: Literal["ask"]
    text: str
    number: NumberAsked | None = None
    choices: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _asks_for_one_thing(self) -> AskStep:
        if (self.number is None) == (not self.choices):
            raise ValueError("expected either `number` or `choices`")
        if len(set(self.choices)) != len(self.choices):
            raise ValueError(f"`choices`: expected each once, got {', '.join(self.choices)}")
        if taken := KEPT_FOR_ACTIONS.intersection(choice.lower() for choice in self.choices):
            raise ValueError(
                f"`choices`: expected other words than redo, skip, abort, got {', '.join(taken)}"
            )
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return self.text


class PlaceTargetStep(FileModel):
    """Have a flat target placed, for the steps that need one without capturing a grid."""

    gives: ClassVar = "target"
    step: Literal["place_target"]
    standoff_mm: Standoff

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Place the target at {self.standoff_mm:g} mm"


class WarmUpStep(FileModel):
    """Let the camera run for some frames with the lasers off: its focal length drifts while it warms."""

    step: Literal["warm_up"]
    frames: Count

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Warm up for {self.frames} frames"


class MeasureLatencyStep(FileModel):
    """Count the frames between a laser's switching on and the first that shows it; it holds from then on."""

    needs: ClassVar = "target"
    step: Literal["measure_latency"]
    most_frames: Annotated[int, Field(ge=0, le=50)] = 20

    @property
    def title(self) -> str:
        """For the progress line."""
        return "Measure the camera's latency"


class GridLimits(FileModel):
    """Limits on the captures of one laser at one placement; see `procedure.capture.quality`."""

    missing: Limit | None = None
    saturated: Limit | None = None
    snr: Limit | None = None
    scatter_px: Limit | None = None


class CaptureGridStep(FileModel):
    """Fire each laser alone at each standoff, `repeats` pairs of frames each."""

    gives: ClassVar = "captures"
    step: Literal["capture_grid"]
    standoffs_mm: Standoffs
    repeats: Count
    limits: GridLimits = GridLimits()

    @model_validator(mode="after")
    def _standoffs_differ(self) -> CaptureGridStep:
        _differ(self.standoffs_mm, "repeats")
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Capture at {len(self.standoffs_mm)} standoffs, {self.repeats} pairs a laser"


class BoardPlacing(FileModel):
    """How the board is to stand: at a standoff, turned about the vertical and the horizontal."""

    standoff_mm: Standoff
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
    frames: Count
    repeats: Count

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Capture the board in {len(self.placings)} placements"


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


def _a_fit_is_not_retried(step: LimitedStep) -> LimitedStep:
    for name, limit in step.limits:
        if limit is not None and limit.on_fail == "retry":
            raise ValueError(f"{name}: on_fail: retry would give the same fit again; expected ask or stop")
    return step


class FitLimits(FileModel):
    """Limits on a fit."""

    rms_px: Limit | None = None
    max_relative_range_sd: Limit | None = None
    noise_scale: Limit | None = None
    rejected: Limit | None = None


class CheckLimitsStep(FileModel):
    """Hold the last fit against limits; `on_fail: ask` leaves it to the operator, with a reason."""

    needs: ClassVar = "fit"
    step: Literal["check_limits"]
    limits: FitLimits

    _no_retry = model_validator(mode="after")(_a_fit_is_not_retried)

    @property
    def title(self) -> str:
        """For the progress line."""
        return "Check the fit's limits"


class ValidationLimits(FileModel):
    """Limits on what the fits without one placement each predict of it."""

    worst_relative_error: Limit | None = None
    """Largest |range - standoff| / standoff."""
    worst_z: Limit | None = None
    """Largest |range - standoff| in its promised standard deviations."""


class ValidateStep(FileModel):
    """Leave each placement of the last fit out in turn: is it ranged as well as promised?"""

    needs: ClassVar = "fit"
    step: Literal["validate"]
    limits: ValidationLimits = ValidationLimits()

    _no_retry = model_validator(mode="after")(_a_fit_is_not_retried)

    @property
    def title(self) -> str:
        """For the progress line."""
        return "Validate on standoffs left out"


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
    readings: Count

    @model_validator(mode="after")
    def _standoffs_differ(self) -> AccuracyTrialStep:
        _differ(self.standoffs_mm, "readings")
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Accuracy at {len(self.standoffs_mm)} standoffs, {self.readings} readings each"


class ThesisSimulationStep(FileModel):
    """Range simulated scenes as the thesis did and as the workbench does; no camera takes part."""

    step: Literal["thesis_simulation"]
    points: Annotated[int, Field(ge=2, le=1_000_000)]
    """Distances of each scene that does not say its own number."""
    scenes: Annotated[tuple[SimulatedScene, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> ThesisSimulationStep:
        names = [scene.name for scene in self.scenes]
        if len(set(names)) != len(names):
            raise ValueError(f"names of scenes must differ, got {names}")
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Simulate {len(self.scenes)} scenes"


Step = Annotated[
    MessageStep
    | ConfirmStep
    | AskStep
    | PlaceTargetStep
    | WarmUpStep
    | MeasureLatencyStep
    | CheckLimitsStep
    | ValidateStep
    | CaptureGridStep
    | CaptureBoardStep
    | FitStep
    | ExportStep
    | AccuracyTrialStep
    | ThesisSimulationStep,
    Field(discriminator="step"),
]


class Procedure(FileModel):
    """A procedure file, format 1."""

    told_by = "procedure"
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
