"""Live ranger in the viewer: closest range, plan view of the obstacle, frame and spots, history."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.model.arrays import Image
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.ranging.lines import LineShape
from workbench.ranging.ranger import Ranger, Reading
from workbench.viewer import blueprint as layout
from workbench.viewer import entities as at
from workbench.viewer import frame
from workbench.viewer.crops import Crops
from workbench.viewer.stream import Moment, Stream

ANSWER = "reading/answer"
PLAN = "plan"
HISTORY = "history/closest"
NOT_RANGED = "history/not_ranged"
SHOWN_READINGS = 60
"""Number of readings in the history."""
PLAN_HEIGHT = 200.0
"""Height of the plan view for the depth from the sensor to 1.25 times the closest range."""
BEYOND = 1.25
CONTOUR_POINTS = 41
_LINE = rr.Radius.ui_points(1.5)
_THICK = rr.Radius.ui_points(4.0)
_DOT = rr.Radius.ui_points(5.0)


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
        scale = plan_scale(reading)
        sensor = self._ranger.sensor
        bars, points, colors, labels = [], [], [], []
        for one in reading.lasers:
            x = self._place_mm(one.laser_id, one.range_mm)
            low = one.range_mm - 2 * one.sigma_mm if one.low_mm is None else one.low_mm
            high = one.range_mm + 2 * one.sigma_mm if one.high_mm is None else one.high_mm
            bars.append([(x, -scale * low), (x, -scale * high)])
            points.append((x, -scale * one.range_mm))
            colors.append(self._colors[one.laser_id])
            labels.append(f"{one.laser_id} {one.range_mm:.0f}")
        some = len(points) > 0
        self._stream.log(
            f"{PLAN}/spots",
            rr.Points2D(points, colors=colors, labels=labels, radii=_DOT if some else None, show_labels=True),
        )
        self._stream.log(
            f"{PLAN}/intervals", rr.LineStrips2D(bars, colors=colors, radii=_THICK if some else None)
        )
        contours = [contour(line, sensor.front_mm(line.axis), scale) for line in reading.lines]
        known = [strip for strip in contours if len(strip)]
        self._stream.log(
            f"{PLAN}/contour", rr.LineStrips2D(known, colors=at.WHITE, radii=_LINE if known else None)
        )

    def _place_mm(self, laser_id: str, range_mm: float) -> float:
        """Position of a laser's spot along its line."""
        calibrated = self._ranger.calibration.laser_ranger
        (ray,) = [laser for laser in calibrated.lasers if laser.id == laser_id]
        along = 0 if ray.axis == "u" else 1
        depth_mm = range_mm + calibrated.reference_plane.offset_mm
        return ray.origin_mm[along] + ray.direction[along] * depth_mm


def plan_scale(reading: Reading) -> float:
    """Height of a millimetre of depth in the plan view."""
    farthest = max((one.range_mm for one in reading.lasers), default=1000.0)
    return PLAN_HEIGHT / (BEYOND * farthest)


def contour(line: LineShape, front_mm: tuple[float, float], scale: float) -> list[tuple[float, float]]:
    """Points of the fitted polynomial across the front, in the plan view; none for an unknown shape."""
    coefficients = line.shape.coefficients
    if not coefficients:
        return []
    x = np.linspace(*front_mm, CONTOUR_POINTS)
    z = np.polynomial.polynomial.polyval(x, coefficients)
    return [(float(a), float(-scale * b)) for a, b in zip(x, z, strict=True)]


def answer_text(reading: Reading) -> str:
    """The answer in large type, the shape with its probabilities, and the notes."""
    if reading.closest_mm is None or reading.sigma_mm is None:
        return "\n\n".join([f"# no range ({reading.status})", *reading.notes])
    lines = [f"# {reading.closest_mm:.1f} ± {reading.sigma_mm:.1f} mm"]
    if reading.interval_mm is not None:
        low, high = reading.interval_mm
        lines.append(f"closest point; 95 % from {low:.1f} to {high:.1f} mm")
    for line in reading.lines:
        angle = line.shape.angle_rad
        turned = "" if angle is None else f", angle {np.degrees(angle):+.1f} deg"
        lines.append(f"**{line.shape.kind}**{turned}")
    return "\n\n".join([*lines, *reading.notes])


def ranger_layout(rig: Rig) -> rrb.Blueprint:
    """Layout of the live ranger, one screen."""
    plan = rrb.Spatial2DView(
        origin=PLAN,
        name="Plan: spots with their 95 % intervals, contour (mm; the sensor is below)",
        visual_bounds=rrb.VisualBounds2D(x_range=(-110.0, 110.0), y_range=(-PLAN_HEIGHT - 10.0, 10.0)),
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
