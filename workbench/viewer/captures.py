"""Captures of the recording so far, and the positions of their placements on the timelines."""

from __future__ import annotations

from dataclasses import dataclass, field

from workbench.model.event import CaptureTaken
from workbench.model.spot import Spot
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.session.capture_table import part_name
from workbench.viewer.stream import Moment


@dataclass(frozen=True)
class CaptureLog:
    """Captures by key, in order."""

    numbers: dict[str, int] = field(default_factory=dict)
    """Number of each capture, from 1."""
    taken: dict[str, CaptureTaken] = field(default_factory=dict)
    placements: dict[str, Placement | None] = field(default_factory=dict)
    """Placement of the target by key of capture."""
    moments: dict[str, Moment] = field(default_factory=dict)
    spots: dict[str, tuple[Spot, ...]] = field(default_factory=dict)

    def add(self, capture: CaptureTaken, placement: Placement | None, moment: Moment) -> None:
        """Append a capture at its moment."""
        self.numbers[capture.key] = moment.capture
        self.taken[capture.key] = capture
        self.placements[capture.key] = placement
        self.moments[capture.key] = moment

    def defects(self) -> Table:
        """Captures of one laser with more or fewer spots than one, or a flagged spot; a row for each cell."""
        numbers: dict[tuple[float, str, str, str], list[int]] = {}
        for key, spots in self.spots.items():
            capture = self.taken[key]
            if capture.purpose == "calibration" and (defect := _defect(spots)):
                cell = capture.standoff_mm, capture.laser_id, capture.placement_key, defect
                numbers.setdefault(cell, []).append(self.numbers[key])
        return Table(
            name="defects",
            title="Captures with a defect",
            columns=(
                Column(key="standoff_mm", name="standoff", unit="mm", format="g"),
                Column(key="laser", name="laser"),
                Column(key="defect", name="defect"),
                Column(key="captures", name="captures"),
            ),
            rows=tuple(
                (standoff_mm, laser, defect, f"{min(n)}-{max(n)}")
                for (standoff_mm, laser, _, defect), n in sorted(numbers.items())
            ),
        )

    def first_of(
        self, placement_key: str | None, standoff_mm: float, laser_id: str | None = None
    ) -> Moment | None:
        """Moment of the first capture at a placement, of one laser where it is named; None without one.

        Args:
            placement_key: key of the placement; None, as in old sessions: the first at this standoff.
            standoff_mm: standoff of the placement.
            laser_id: laser of the capture; None: any.
        """
        for key, capture in self.taken.items():
            here = (
                capture.standoff_mm == standoff_mm
                if placement_key is None
                else capture.placement_key == placement_key
            )
            if here and laser_id in (None, capture.laser_id):
                return self.moments[key]
        return None

    def ranges(self) -> dict[str, str]:
        """Numbers of the captures at each placement as text, `361-400`, by key of the placement."""
        found: dict[str, list[int]] = {}
        for key, capture in self.taken.items():
            found.setdefault(capture.placement_key, []).append(self.numbers[key])
        return {key: f"{min(n)}-{max(n)}" for key, n in found.items()}


def capture_record(capture: CaptureTaken) -> dict[str, list[str | float | int]]:
    """Subject of a capture, for `readback.observations_of_recording`: a list of one value for each quantity.

    Rerun converts lists faster than single values.
    """
    unknown = float("nan")
    values: dict[str, str | float | int | None] = {
        "purpose": capture.purpose,
        "laser_id": capture.laser_id,
        "placement": capture.placement_key,
        "nominal_mm": float(capture.standoff_mm),  # `standoff_mm` is a timeline
        "nominal_sd_mm": unknown if capture.standoff_sd_mm is None else float(capture.standoff_sd_mm),
        "repeat": capture.repeat,
        "source": capture.on.path,
        "clock_ns": capture.time_ns,
        "part": part_name(capture),
    }
    return {name: [value] for name, value in values.items() if value is not None}


def _defect(spots: tuple[Spot, ...]) -> str:
    """Defect of a capture of one laser; empty for one sound spot."""
    if len(spots) != 1:
        return f"{len(spots)} spots instead of 1" if spots else "no spot"
    return ", ".join(sorted(spots[0].flags))
