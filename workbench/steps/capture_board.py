"""Step `capture_board`: capture the printed board in room light and with each laser, at several tilts."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from workbench.model.fields import Count, Standoff
from workbench.model.number_text import counted
from workbench.model.rig import NonNegativeFloat, Rig
from workbench.model.target import BoardTarget, Placement
from workbench.model.yamlfile import FileModel
from workbench.optics.rows import rows_of_rig
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.placements import visit_placements
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


class BoardPlacement(FileModel):
    """Placement of the board: standoff, and rotation about the vertical and the horizontal axis."""

    standoff_mm: Standoff
    yaw_deg: Annotated[float, Field(gt=-90, lt=90)] = 0.0
    """Rotation about the vertical; positive moves the right side away."""
    pitch_deg: Annotated[float, Field(gt=-90, lt=90)] = 0.0
    """Rotation about the horizontal; positive moves the lower side away."""
    standoff_sd_mm: NonNegativeFloat | None = None
    """Standard uncertainty of the standoff; None: that of the rig file."""


@register
class CaptureBoardStep(StepModel):
    """Capture `frames` in room light and `repeats` pairs of each laser at each placement of the board."""

    gives: ClassVar[str | None] = "captures"
    step: Literal["capture_board"]
    placings: Annotated[tuple[BoardPlacement, ...], Field(min_length=1)]
    frames: Count
    repeats: Count

    @property
    def title(self) -> str:
        """Number of placements."""
        return f"Capture the board in {counted(len(self.placings), 'placement')}"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """Placements, numbered from 1 because the board may have several tilts at one standoff."""
        rows = rows_of_rig(rig)
        roll_deg = float(rows[0].angle_deg) if len(rows) == 1 else 0.0  # the blank band takes a single row
        return [
            Placement(
                key=f"{name}/{number:02d}-{placing.standoff_mm:.12g}mm",
                standoff_mm=placing.standoff_mm,
                target=BoardTarget(yaw_deg=placing.yaw_deg, pitch_deg=placing.pitch_deg, roll_deg=roll_deg),
                standoff_sd_mm=placing.standoff_sd_mm,
            )
            for number, placing in enumerate(self.placings, start=1)
        ]

    def captures(self, rig: Rig) -> int:
        """Number of frames in room light and of pairs of all lasers, over all placements."""
        return len(self.placings) * (self.frames + self.repeats * len(rig.lasers))

    def run(self, context: Context, name: str) -> str:
        """Capture at every placement; raises the errors of `visit_placements`."""
        from workbench.calibration.data.boards import BoardView, see_board
        from workbench.calibration.data.observations import PlacementInfo
        from workbench.model.fit_event import Rejected

        def work(placement: Placement) -> None:
            frames = [
                context.capture_room_light(f"{placement.key}/board/{repeat:02d}", placement, repeat)
                for repeat in range(self.frames)
            ]
            standoff_sd_mm = nan if placement.standoff_sd_mm is None else placement.standoff_sd_mm
            info = PlacementInfo(placement.key, placement.standoff_mm, standoff_sd_mm, 0.0, placement.key)
            context.boards[placement.key] = see_board(frames, context.rig.banded_board, info)
            capture_lasers(context, placement, self.repeats)

        visit_placements(context, self.placements(name, context.rig), work)
        views = [seen for key, seen in context.boards.items() if key.startswith(f"{name}/")]
        corners = sum(len(seen.corners.ids) for seen in views if isinstance(seen, BoardView))
        missed = [seen.reason for seen in views if isinstance(seen, Rejected)]
        placements = f"{len(views) - len(missed)} of {counted(len(views), 'placement')}"
        return "; ".join([f"{counted(corners, 'corner')} in {placements}", *missed])
