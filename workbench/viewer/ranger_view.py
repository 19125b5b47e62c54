"""Live ranger in the viewer: closest range, plan view of the obstacle, frame and spots, history."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.model.arrays import Image
from workbench.model.event import LaserRange
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.ranging.lines import LineShape
from workbench.ranging.ranger import Ranger, Reading
from workbench.ranging.shape import Shape
from workbench.sensor.calibrated import CalibratedSensor
from workbench.viewer import blueprint as layout
from workbench.viewer import entities as at
from workbench.viewer import frame
from workbench.viewer.crops import Crops
from workbench.viewer.stream import Moment, Stream

ANSWER = "reading/answer"
PLAN = "plan"
HISTORY = "history/closest"
SHOWN_READINGS = 60
"""Number of readings in the history."""
PLAN_HEIGHT = 120.0
"""Height of the plan view in its units. One unit is 1 mm, true to scale, where the intervals fit."""
MARGIN = 1.25
"""Depth that is drawn over that of all intervals, where these do not fit."""
LABEL_ROWS = (PLAN_HEIGHT / 2, PLAN_HEIGHT / 2 + 12.0)
"""Heights of the labels, alternately: neighbours do not overlap."""
PLAN_BOUNDS = rrb.VisualBounds2D(
    x_range=(-110.0, 110.0), y_range=(-PLAN_HEIGHT / 2 - 2.0, LABEL_ROWS[1] + 14.0)
)
CONTOUR_POINTS = 41
CAP_MM = 5.0
"""Half length of the bars across the interval of the closest point."""
LEAST_PROBABILITY = 0.005
"""Smallest probability of a shape that is shown."""
_LINE = rr.Radius.ui_points(1.5)
_THICK = rr.Radius.ui_points(4.0)
_NO_DOT = rr.Radius.ui_points(0.0)


@dataclass(frozen=True)
class Shown:
    """One reading with the frames that it comes from."""

    reading: Reading
    on: Image
    off: Image
    spots: tuple[Spot, ...]
    """Spots of the capture with all lasers."""


class RangerView:
    """View of readings as they come."""

    def __init__(self, stream: Stream, rig: Rig, ranger: Ranger) -> None:
        self._ranger = ranger
        self._full_scale = 2**rig.camera.bits - 1
        self._colors = at.laser_colors(rig.laser_ids)
        self._stream = stream
        self._crops = Crops(self._stream, self._colors)
        self._number = 0

    def take(self, shown: Shown) -> None:
        """Log one reading."""
        self._number += 1
        self._stream.at(Moment(self._number, 0, time.time_ns()))
        reading = shown.reading
        frame.log_image(self._stream, shown.on, shown.off, self._full_scale)
        spots = frame.assigned(shown.spots, reading.lasers)
        frame.log_assigned(self._stream, shown.spots, spots, self._colors, shown.on.shape[0])
        self._crops.take(shown.on, shown.off, spots, {})
        text = rr.TextDocument(answer_text(reading), media_type=rr.MediaType.MARKDOWN)
        self._stream.log(ANSWER, text)
        self._log_plan(reading)
        if reading.closest_mm is not None and reading.sigma_mm is not None:
            closest = rr.Measurements(
                values=[reading.closest_mm], variances=[reading.sigma_mm**2], units="mm", names="closest"
            )
            self._stream.log(HISTORY, closest)

    def close(self) -> None:
        """Flush what is logged; the viewer keeps it."""
        self._stream.close()

    def _log_plan(self, reading: Reading) -> None:
        """Log the obstacle from above: spots with their intervals, contour, closest point."""
        depths = Depths.of(reading)
        sensor = self._ranger.sensor
        bars, labels, colors, texts = [], [], [], []
        for n, one in enumerate(reading.lasers):
            x = self._place_mm(one.laser_id, one.range_mm)
            near, far = depths.heights(interval_of(one))
            bars.append([(x, near), (x, far)])
            labels.append((x, LABEL_ROWS[n % len(LABEL_ROWS)]))
            colors.append(self._colors[one.laser_id])
            texts.append(f"{one.laser_id} {one.range_mm:.0f}")
        some = len(bars) > 0
        self._stream.log(
            f"{PLAN}/spots",
            rr.Points2D(
                labels, colors=colors, labels=texts, radii=_NO_DOT if some else None, show_labels=True
            ),
        )
        self._stream.log(
            f"{PLAN}/intervals", rr.LineStrips2D(bars, colors=colors, radii=_THICK if some else None)
        )
        contours = [contour(line, _front_mm(sensor, line, reading), depths) for line in reading.lines]
        known = [strip for strip in contours if len(strip)]
        self._stream.log(
            f"{PLAN}/contour", rr.LineStrips2D(known, colors=at.WHITE, radii=_LINE if known else None)
        )
        closest = closest_bar(reading, depths)
        self._stream.log(
            f"{PLAN}/closest", rr.LineStrips2D(closest, colors=at.WHITE, radii=_LINE if closest else None)
        )

    def _place_mm(self, laser_id: str, range_mm: float) -> float:
        """Position of a laser's spot along its row."""
        sensor = self._ranger.sensor
        index = sensor.ids.index(laser_id)
        (row,) = [one for one in sensor.rows if index in one.members]
        return float(row.direction @ sensor.positions_mm([laser_id], np.array([range_mm]))[:, 0])


@dataclass(frozen=True)
class Depths:
    """Heights of ranges in the plan view; a farther point is higher."""

    middle_mm: float
    """Range at height 0."""
    scale: float
    """Height of 1 mm of range."""

    @classmethod
    def of(cls, reading: Reading) -> Depths:
        """Depths with all intervals of a reading in view, at most true to scale."""
        shapes = [line.shape for line in reading.lines]
        intervals = [*map(interval_of, reading.lasers), *(shape.closest_interval_mm for shape in shapes)]
        ends = [mm for interval in intervals for mm in interval if isfinite(mm)]
        if not ends:
            return cls(0.0, 1.0)
        return cls(
            (min(ends) + max(ends)) / 2, min(1.0, PLAN_HEIGHT / MARGIN / max(max(ends) - min(ends), 1.0))
        )

    def heights(self, ranges_mm: Iterable[float]) -> list[float]:
        """Heights of ranges; those out of view are at its edge."""
        half = PLAN_HEIGHT / 2
        return [min(half, max(-half, self.scale * (self.middle_mm - mm))) for mm in ranges_mm]


def interval_of(one: LaserRange) -> tuple[float, float]:
    """95 % interval of a laser's range, mm."""
    low = one.range_mm - 2 * one.sigma_mm if one.low_mm is None else one.low_mm
    high = one.range_mm + 2 * one.sigma_mm if one.high_mm is None else one.high_mm
    return low, high


def closest_bar(reading: Reading, depths: Depths) -> list[list[tuple[float, float]]]:
    """Lines of the closest point in the plan view; none without a shape.

    Its 95 % interval, with bars across both ends and the point.
    """
    if not reading.lines:
        return []
    shape = min((line.shape for line in reading.lines), key=lambda one: one.closest_mm)
    x, (low, high) = shape.closest_x_mm, shape.closest_interval_mm
    ends = depths.heights((low, shape.closest_mm, high))
    bars = [[(x - CAP_MM, y), (x + CAP_MM, y)] for y in ends]
    return [[(x, ends[0]), (x, ends[-1])], *bars]


def _front_mm(sensor: CalibratedSensor, line: LineShape, reading: Reading) -> tuple[float, float]:
    """Front of a row at the mean range of its spots."""
    range_mm = float(np.mean([reading.lasers[n].range_mm for n in line.indices]))
    return sensor.front_mm(line.row, range_mm)


def contour(line: LineShape, front_mm: tuple[float, float], depths: Depths) -> list[tuple[float, float]]:
    """Points of the fitted polynomial across the front, in the plan view; none for an unknown shape."""
    coefficients = line.shape.coefficients
    if not coefficients:
        return []
    x = np.linspace(*front_mm, CONTOUR_POINTS)
    z = np.polynomial.polynomial.polyval(x, coefficients)
    return [*zip(x.tolist(), depths.heights(z.tolist()), strict=True)]


def answer_text(reading: Reading) -> str:
    """The answer in large type, the shape with its probabilities, and the notes."""
    if reading.closest_mm is None or reading.sigma_mm is None:
        return "\n\n".join([f"# no range ({reading.status})", *reading.notes])
    lines = [f"# {reading.closest_mm:.1f} ± {reading.sigma_mm:.1f} mm"]
    if reading.interval_mm is not None:
        low, high = reading.interval_mm
        lines.append(f"closest point; 95 % from {low:.1f} to {high:.1f} mm")
    for line in reading.shapes:
        angle = line.shape.angle_rad
        turned = "" if angle is None else f", angle {np.degrees(angle):+.1f} deg"
        lines.append(f"**{line.shape.kind}**{turned}{_odds(line.shape)}")
    return "\n\n".join([*lines, *reading.notes])


def _odds(shape: Shape) -> str:
    """Posterior probability of each kind, the largest first; empty where there is none."""
    ordered = sorted(shape.probabilities.items(), key=lambda one: -one[1])
    shown = [f"{kind} {100 * p:.0f} %" for kind, p in ordered if p >= LEAST_PROBABILITY]
    return f" ({', '.join(shown)})" if shown else ""


def ranger_layout(rig: Rig) -> rrb.Blueprint:
    """Layout of the live ranger, one screen."""
    plan = rrb.Spatial2DView(
        origin=PLAN,
        name="From above: 95 % intervals; white: closest point",
        visual_bounds=PLAN_BOUNDS,
        background=layout.DARK,
    )
    left = rrb.Vertical(layout.text_view(ANSWER, "Answer"), plan, row_shares=[1, 2])
    upper = rrb.Horizontal(left, layout.frame_view(rig), layout.crops_view(rig), column_shares=[9, 8, 8])
    last = rrb.VisibleTimeRange(
        at.CAPTURE,
        start=rrb.TimeRangeBoundary.cursor_relative(seq=-SHOWN_READINGS),
        end=rrb.TimeRangeBoundary.cursor_relative(seq=0),
    )
    history = rrb.TimeSeriesView(origin="history", name="Closest range [mm], u shaded", time_ranges=last)
    return rrb.Blueprint(
        rrb.Vertical(upper, history, row_shares=[2, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=at.CAPTURE, play_state="following"),
        auto_layout=False,
        auto_views=False,
    )
