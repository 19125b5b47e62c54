"""What happens in a session, one typed record each: the journal's lines and the viewer's only input.

A consumer is anything callable with a `Record`. Records name frames by their path in the session folder, so
that every view (the recording, a table, a report) can be made again from the folder alone. What a fit and a
trial tell is in modules of their own, and reached by this one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from workbench.model.exposure import Verdict as BrightnessVerdict
from workbench.model.fit_event import CrossValidatedPlacement as CrossValidatedPlacement
from workbench.model.fit_event import Fault as Fault
from workbench.model.fit_event import FitFinished as FitFinished
from workbench.model.fit_event import LaserError as LaserError
from workbench.model.fit_event import ParameterRecord as ParameterRecord
from workbench.model.fit_event import Rejected as Rejected
from workbench.model.fit_event import ResidualRecord as ResidualRecord
from workbench.model.fit_event import ResidualTest as ResidualTest
from workbench.model.legacy_events import upgraded
from workbench.model.limit import Verdict
from workbench.model.prompt import Answer, By
from workbench.model.spot import Spot
from workbench.model.target import Placement
from workbench.model.trial_event import LaserRange as LaserRange
from workbench.model.trial_event import ReadingTaken as ReadingTaken
from workbench.model.trial_event import TrialFinished as TrialFinished
from workbench.model.trial_event import TrialProgress as TrialProgress
from workbench.model.yamlfile import FileModel


class SessionStarted(FileModel):
    """First record of a session."""

    kind: Literal["session_started"] = "session_started"
    session: str
    rig: str
    procedures: tuple[str, ...]


class ProcedureStarted(FileModel):
    """A procedure's first step is about to start."""

    kind: Literal["procedure_started"] = "procedure_started"
    procedure: str
    title: str
    steps: int

    @property
    def length(self) -> str:
        """For people."""
        return f"{self.steps} step" if self.steps == 1 else f"{self.steps} steps"


class StepStarted(FileModel):
    """A step is about to run. `index` counts from 1 within its procedure."""

    kind: Literal["step_started"] = "step_started"
    procedure: str
    index: int
    step: str
    title: str
    shots: int
    """Captures that the step will take, 0 for a step that takes none."""


class StepFinished(FileModel):
    """A step has ended well; a step that failed ends the session instead."""

    kind: Literal["step_finished"] = "step_finished"
    procedure: str
    index: int
    outcome: str


class TargetPlaced(FileModel):
    """The target stands where it was asked to, or where the technician says that it stands."""

    kind: Literal["target_placed"] = "target_placed"
    placement: Placement
    by: By | None = None
    """Who says so."""


class Answered(FileModel):
    """A question has been answered. A target that was placed is told by `TargetPlaced` instead."""

    kind: Literal["answered"] = "answered"
    key: str
    """Of the prompt: the step's name, a placement's key, or `safety`."""
    question: str
    answer: Answer


class PlacementFinished(FileModel):
    """Everything that was to be captured at a placement is captured; a resumed session keeps it."""

    kind: Literal["placement_finished"] = "placement_finished"
    key: str


class SetAside(FileModel):
    """The records from `from_n` on count no more: a placement is captured again, or left out."""

    kind: Literal["set_aside"] = "set_aside"
    key: str
    """The placement's."""
    from_n: int
    reason: str
    retry: bool = False
    """Whether a limit asked for it by itself (`on_fail: retry`): that is done a few times at most."""
    left_out: bool = False
    """Whether the placement is left out, and not captured again."""

    @property
    def text(self) -> str:
        """For people, one line."""
        return f"{self.key} is {'left out' if self.left_out else 'captured again'}: {self.reason}"


class SessionResumed(FileModel):
    """A session that ended early goes on; its records from `from_n` on count no more."""

    kind: Literal["session_resumed"] = "session_resumed"
    from_n: int
    operator: str
    command: str
    created: str
    changes: tuple[str, ...] = ()
    """What was different from the session's files: rig, procedure, version of the workbench."""
    accepted_because: str | None = None


class ExposureSet(FileModel):
    """The camera's exposure for what is captured at a placement, found by trial pairs with all lasers lit."""

    kind: Literal["exposure_set"] = "exposure_set"
    key: str
    """The placement's."""
    exposure: float
    unit: str
    """Empty for the camera driver's own."""
    peak: float
    """Brightest pixel of that trial as a share of full scale, or of where trials were clipped below it.

    The room's median where no laser is seen.
    """
    verdict: BrightnessVerdict
    """By `workbench.model.exposure`; not good where the camera's limits or steps give no better."""
    trials: int

    @property
    def text(self) -> str:
        """One line for people."""
        spelt = f"exposure {self.exposure:g} {self.unit}".rstrip()
        if self.verdict == "unseen":
            return (
                f"{spelt}, no laser seen, the room is at {100 * self.peak:.0f} % of full scale: do the lasers"
                " shine on the target, where the rig file expects them? Darken the room if it is bright"
            )
        share = f"brightest spot at {100 * self.peak:.0f} % of full scale"
        remarks = {
            "clipped": ", clipped: take a darker target or a filter",
            "bright": ", bright: no shorter exposure; a darker target or a filter would help",
            "dim": ", dim: no longer exposure is good; does every spot lie on the target?",
        }
        return f"{spelt}, {share}{remarks.get(self.verdict, '')}"


class FrameRef(FileModel):
    """A stored frame."""

    path: str
    """Relative to the session folder."""
    sha256: str
    time_ns: int
    """Wall clock at exposure, nanoseconds since 1970 (UTC)."""


class CaptureTaken(FileModel):
    """A pair of frames, lasers on and off. Its frames are on disk before this is written."""

    kind: Literal["capture_taken"] = "capture_taken"
    key: str
    """Unique in the session."""
    purpose: Literal["calibration", "trial"]
    scene: str | None = None
    laser_id: str
    """`all` when every laser is lit; `board` for a frame of the board in room light, with no laser lit."""
    placement_key: str
    standoff_mm: float
    standoff_sd_mm: float | None = None
    """1 sigma, where the placement states one."""
    repeat: int
    on: FrameRef
    off: FrameRef | None = None
    exposure: float | None = None
    """None where it was not set."""
    exposure_unit: str | None = None
    """None for the camera driver's own."""
    lit_s: float | None = None
    """How long a laser was lit for it, switching included; None for a frame in room light."""


class SpotsFound(FileModel):
    """The spots of one capture, and why others were not found."""

    kind: Literal["spots_found"] = "spots_found"
    key: str
    spots: tuple[Spot, ...]
    failures: tuple[str, ...] = ()


class LimitChecked(FileModel):
    """A measured quantity has been held against a limit of the procedure."""

    kind: Literal["limit_checked"] = "limit_checked"
    step: str
    of: str
    """What it was measured on: `fit`, or a laser at a placement."""
    quantity: str
    value: float | None
    """None where it could not be measured."""
    limit: str
    verdict: Verdict


class LatencyMeasured(FileModel):
    """So many frames of the camera's stream are older than the last switching of a laser."""

    kind: Literal["latency_measured"] = "latency_measured"
    frames: int


class StandoffAdvised(FileModel):
    """How good ranges are by the captures so far, and where the target would help most next.

    Relative standard deviations of a single range (1 sigma), the largest from the nearest to the farthest
    standoff of the procedure.
    """

    kind: Literal["standoff_advised"] = "standoff_advised"
    placements: int
    relative_range_sd: float
    limit: float
    """What the fit step to come demands."""
    next_standoff_mm: float
    then_relative_range_sd: float
    """With a placement there."""
    worst_residual_px: float | None = None
    """Of a laser's mean position at a placement: the one that is the most deviations of noise off the fit."""
    worst_residual_sd: float | None = None
    worst_laser_id: str = ""
    worst_standoff_mm: float | None = None

    @property
    def text(self) -> str:
        """For people, one or two lines."""
        met = "reached" if self.relative_range_sd <= self.limit else "not yet"
        return (
            f"so far ranges to {100 * self.relative_range_sd:.2g} % ({100 * self.limit:g} % wanted: {met});"
            f" best next {self.next_standoff_mm:g} mm: to {100 * self.then_relative_range_sd:.2g} %"
            f"{self._worst}"
        )

    @property
    def _worst(self) -> str:
        if self.worst_residual_px is None:
            return ""
        return (
            f"; worst residual {self.worst_residual_px:.2g} px ({self.worst_residual_sd:.2g} sd),"
            f" {self.worst_laser_id} at {self.worst_standoff_mm:g} mm"
        )


class CalibrationExported(FileModel):
    """The calibration YAML is on disk."""

    kind: Literal["calibration_exported"] = "calibration_exported"
    path: str
    sha256: str


class SessionFinished(FileModel):
    """Last record of a session that ended, well or not."""

    kind: Literal["session_finished"] = "session_finished"
    exit_code: int
    message: str


Event = Annotated[
    SessionStarted
    | ProcedureStarted
    | StepStarted
    | StepFinished
    | TargetPlaced
    | ExposureSet
    | Answered
    | PlacementFinished
    | SetAside
    | SessionResumed
    | CaptureTaken
    | SpotsFound
    | LimitChecked
    | LatencyMeasured
    | StandoffAdvised
    | FitFinished
    | CalibrationExported
    | ReadingTaken
    | TrialProgress
    | TrialFinished
    | SessionFinished,
    Field(discriminator="kind"),
    BeforeValidator(upgraded),
]


class Record(FileModel):
    """An event with its place in the session."""

    n: int
    """Counts from 0 without a gap."""
    time_ns: int
    """Wall clock, nanoseconds since 1970 (UTC)."""
    event: Event


Consumer = Callable[[Record], None]
