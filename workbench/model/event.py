"""Events of a session, one typed record each: the journal's lines and the viewer's only input.

A consumer is anything callable with a `Record`. Records refer to frames by their path in the session folder,
so every view (recording, table, report) can be made again from the folder alone. Events of fits, of
trials, and about the records themselves are defined in modules of their own and exported here.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from workbench.model.dates import CHECK_CLOCK, CLOCK_TOLERANCE
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
from workbench.model.session_event import Incident as Incident
from workbench.model.session_event import SessionRepaired as SessionRepaired
from workbench.model.session_event import SessionResumed as SessionResumed
from workbench.model.session_event import SetAside as SetAside
from workbench.model.spot import Spot
from workbench.model.target import Placement
from workbench.model.trial_event import LaserRange as LaserRange
from workbench.model.trial_event import ReadingTaken as ReadingTaken
from workbench.model.trial_event import TrialFinished as TrialFinished
from workbench.model.trial_event import TrialProgress as TrialProgress
from workbench.model.trial_event import TrueValues as TrueValues
from workbench.model.trial_event import VehicleMoved as VehicleMoved
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
        """Number of steps with its noun."""
        return f"{self.steps} step" if self.steps == 1 else f"{self.steps} steps"


class StepStarted(FileModel):
    """A step is about to run. `index` counts from 1 within the procedure."""

    kind: Literal["step_started"] = "step_started"
    procedure: str
    index: int
    step: str
    title: str
    shots: int
    """Number of captures that the step will take."""


class StepFinished(FileModel):
    """A step has succeeded; a step that fails ends the session instead."""

    kind: Literal["step_finished"] = "step_finished"
    procedure: str
    index: int
    outcome: str


class TargetPlaced(FileModel):
    """The target has been placed; the standoff is as requested or as the technician entered it."""

    kind: Literal["target_placed"] = "target_placed"
    placement: Placement
    by: By | None = None
    """Source of the confirmation."""


class Answered(FileModel):
    """A prompt has been answered. The answer that the target is placed is `TargetPlaced` instead."""

    kind: Literal["answered"] = "answered"
    key: str
    """Key of the prompt: the step's name, a placement's key, or `safety`."""
    question: str
    answer: Answer
    overrules: bool = False
    """Whether the answer keeps results in spite of a failed check, which `question` describes."""


class PlacementFinished(FileModel):
    """All captures at a placement are complete; a resumed session keeps them."""

    kind: Literal["placement_finished"] = "placement_finished"
    key: str


class ExposureSet(FileModel):
    """Exposure of the camera for the captures at a placement, found by trial exposures with all lasers on."""

    kind: Literal["exposure_set"] = "exposure_set"
    key: str
    """Key of the placement."""
    exposure: float
    unit: str
    """Unit of `exposure`; empty: the camera driver's own."""
    peak: float
    """Brightest pixel of the chosen trial exposure as a share of full scale, or of a lower clipping level.

    The median of the room light if no laser is seen.
    """
    verdict: BrightnessVerdict
    """See `workbench.model.exposure`; other than good if the camera's limits or steps allow no better one."""
    trials: int
    """Number of trial exposures."""

    @property
    def text(self) -> str:
        """Summary in one line."""
        setting = f"exposure {self.exposure:g} {self.unit}".rstrip()
        if self.verdict == "unseen":
            return (
                f"{setting}: no laser seen, room light at {100 * self.peak:.0f} % of full scale; check that"
                " the lasers hit the target where the rig file expects them; darken a bright room"
            )
        share = f"brightest spot at {100 * self.peak:.0f} % of full scale"
        remarks = {
            "clipped": ", clipped: use a darker target or a filter",
            "bright": ", bright: the exposure cannot be shortened; use a darker target or a filter",
            "dim": ", dim: the exposure cannot be lengthened; check that every spot lies on the target",
        }
        return f"{setting}, {share}{remarks.get(self.verdict, '')}"


class FrameRef(FileModel):
    """Reference to a stored frame."""

    path: str
    """Path relative to the session folder."""
    sha256: str
    time_ns: int
    """Wall clock time of the exposure, nanoseconds since 1970 (UTC)."""


class CaptureTaken(FileModel):
    """A pair of frames, lasers on and off. The frames are on disk before this event is written."""

    kind: Literal["capture_taken"] = "capture_taken"
    key: str
    """Key of the capture, unique in the session."""
    purpose: Literal["calibration", "trial"]
    scene: str | None = None
    laser_id: str
    """`all` if every laser is on; `board` for a frame of the board in room light, all lasers off."""
    left_off: tuple[str, ...] = ()
    """Lasers that were left off although the capture is one of all lasers."""
    placement_key: str
    standoff_mm: float
    standoff_sd_mm: float | None = None
    """Standard uncertainty of the standoff; None: that of the rig file."""
    repeat: int
    on: FrameRef
    off: FrameRef | None = None
    exposure: float | None = None
    """None if no exposure was set."""
    exposure_unit: str | None = None
    """Unit of `exposure`; None: the camera driver's own."""
    lit_s: float | None = None
    """Emission time, switching included; None for a frame in room light."""
    clock_ns: int | None = None
    """Time by the clock of the bench, ns: UTC, on a virtual bench simulated. None in sessions of versions
    that did not record it."""
    part: Annotated[int, Field(ge=0)] = 0
    """Number of the uninterrupted part of the session, from 0; a resumption or a repair begins the next."""
    head_deg: float | None = None
    """Reading of the scanning head's encoder; None without a head that was turned."""

    @property
    def time_ns(self) -> int:
        """Time by the clock of the bench, or that of the lit frame, ns."""
        return self.on.time_ns if self.clock_ns is None else self.clock_ns


class SpotsFound(FileModel):
    """Spots of one capture, and causes of missing spots."""

    kind: Literal["spots_found"] = "spots_found"
    key: str
    spots: tuple[Spot, ...]
    failures: tuple[str, ...] = ()


class LimitChecked(FileModel):
    """A measured quantity has been compared with a limit of the procedure."""

    kind: Literal["limit_checked"] = "limit_checked"
    step: str
    of: str
    """Subject of the measurement: `fit`, or a laser at a placement."""
    quantity: str
    value: float | None
    """None if it could not be measured."""
    limit: str
    verdict: Verdict


class LatencyMeasured(FileModel):
    """The latency of the camera has been measured."""

    kind: Literal["latency_measured"] = "latency_measured"
    frames: int
    """Number of frames in the stream that precede the first one exposed after a laser was switched."""
    darkening: float | None = None
    """Relative darkening of the background while a laser is on, by automatic exposure or gain; None: none."""
    dimming: float | None = None
    """Relative dimming of the spot after switching on, by automatic exposure or by the laser; None: none."""


LEAST_GAIN = 0.02
"""Least relative decrease of the range uncertainty for which a further standoff is proposed."""


class StandoffAdvised(FileModel):
    """Uncertainty of ranges after the captures so far, and the most informative next standoff.

    Relative standard deviations (1 sigma) are those of a single range, the largest between the nearest and
    the farthest standoff of the procedure.
    """

    kind: Literal["standoff_advised"] = "standoff_advised"
    placements: int
    relative_range_sd: float
    limit: float
    """Limit of the next fit step on `relative_range_sd`."""
    next_standoff_mm: float
    then_relative_range_sd: float
    """Forecast of `relative_range_sd` after a placement at `next_standoff_mm`."""
    worst_residual_px: float | None = None
    """Residual of a laser's mean position at a placement: the largest in standard deviations of its noise."""
    worst_residual_sd: float | None = None
    worst_laser_id: str = ""
    worst_standoff_mm: float | None = None
    ranges_mm: tuple[float, ...] = ()
    """Ranges whose uncertainty is shown; empty in sessions of versions that did not record it."""
    range_sd: tuple[float, ...] = ()
    """Relative standard deviation of a single range at each of them, the largest of any laser."""
    parameter_sd: dict[str, float] = Field(default_factory=dict)
    """Standard deviation of each free parameter of the sensor, relative to its prior's."""

    @property
    def text(self) -> str:
        """Summary in one or two lines."""
        met = "met" if self.relative_range_sd <= self.limit else "not yet met"
        following = (
            f"best next standoff {self.next_standoff_mm:g} mm: {100 * self.then_relative_range_sd:.2g} %"
            if self.next_helps
            else f"no further standoff lowers it by {100 * LEAST_GAIN:g} % of its value"
        )
        return (
            f"range uncertainty {100 * self.relative_range_sd:.2g} % (limit {100 * self.limit:g} %: {met});"
            f" {following}{self._worst}"
        )

    @property
    def next_helps(self) -> bool:
        """Whether a placement at `next_standoff_mm` lowers the range uncertainty noticeably."""
        return self.then_relative_range_sd < (1 - LEAST_GAIN) * self.relative_range_sd

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


class CalibrationLoaded(FileModel):
    """The session uses an existing calibration, of which it keeps a copy."""

    kind: Literal["calibration_loaded"] = "calibration_loaded"
    file: str
    """File named by the user."""
    path: str
    """Copy, relative to the session folder."""
    sha256: str
    made: str
    """Time of the calibration, as in its provenance."""
    age_days: float | None
    """Age at the start of the session; None if `made` is no time."""

    @property
    def text(self) -> str:
        """Summary in one line."""
        made = f"made {self.made}" if self.made else "of unknown date"
        return f"calibration {self.file}, {made}, {self._age_text}"

    @property
    def _age_text(self) -> str:
        if self.age_days is None:
            return "age unknown"
        if timedelta(days=-self.age_days) > CLOCK_TOLERANCE:
            return f"dated {-self.age_days:.1f} days in the future: {CHECK_CLOCK}"
        return f"{max(self.age_days, 0.0):.1f} days old"


class SessionFinished(FileModel):
    """Last record of a session that ended, with or without success."""

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
    | SessionRepaired
    | CaptureTaken
    | SpotsFound
    | LimitChecked
    | LatencyMeasured
    | StandoffAdvised
    | FitFinished
    | CalibrationExported
    | CalibrationLoaded
    | ReadingTaken
    | VehicleMoved
    | TrialProgress
    | TrialFinished
    | Incident
    | SessionFinished,
    Field(discriminator="kind"),
    BeforeValidator(upgraded),
]


class Record(FileModel):
    """An event with its number and time."""

    n: Annotated[int, Field(ge=0)]
    """Number in the session, from 0 without gaps."""
    time_ns: Annotated[int, Field(ge=0, lt=2**63)]
    """Wall clock time, nanoseconds since 1970 (UTC)."""
    event: Event


class ConsumerFailedError(Exception):
    """Failure of a consumer that the session survives; raised once, and journalled as an `Incident`."""

    def __init__(self, of: str, cause: str) -> None:
        super().__init__(f"{of}: {cause}")
        self.incident = Incident(of=of, message=cause)


Consumer = Callable[[Record], None]
"""Raises `ConsumerFailedError` for a failure that must not end the session."""
