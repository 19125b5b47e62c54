"""Lasers while they are aimed: all spots in one frame, each magnified, the table, widths over time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.model.table import Table
from workbench.procedure.aiming import AimReading
from workbench.viewer import blueprint as layout
from workbench.viewer import entities as at
from workbench.viewer import frame
from workbench.viewer.crops import Crops
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

TABLE = "aim/table"
WIDTH = "aim/width_px"
PEAK = "aim/peak_dn"
SHOWN_ROUNDS = 120
"""Number of rounds in the curves."""

Shown = tuple[tuple[AimReading, ...], Table]
"""Readings of all lasers in turn, and their table."""


class AimView:
    """View of rounds of readings as they come."""

    def __init__(self, stream: Stream, rig: Rig) -> None:
        self._stream, self._rig = stream, rig
        self._colors = at.laser_colors(rig.laser_ids)
        self._crops = Crops(stream, self._colors)
        self._number = 0
        for entity in (WIDTH, PEAK):
            for laser, color in self._colors.items():
                style = rr.SeriesLines(colors=color, names=laser)
                stream.log(at.under(entity, laser), style, static=True)

    def take(self, shown: Shown) -> None:
        """Log one round."""
        readings, table = shown
        self._number += 1
        self._stream.at(Moment(self._number, 0, time.time_ns()))
        spots = [spot for one in readings if (spot := _named(one)) is not None]
        brightest = np.maximum.reduce([one.on for one in readings])
        camera = self._rig.camera
        frame.log_image(self._stream, brightest, readings[-1].off, 2**camera.bits - 1)
        frame.log_spots(self._stream, spots, self._colors, camera.height_px)
        expected = {
            one.laser_id: np.array([one.expected.u_px, one.expected.v_px])
            for one in readings
            if one.expected is not None
        }
        frame.log_predicted(self._stream, expected, self._colors)
        self._crops.take_each(
            [
                (
                    one.on,
                    one.off,
                    [spot] if (spot := _named(one)) else [],
                    {name: place for name, place in expected.items() if name == one.laser_id},
                )
                for one in readings
            ]
        )
        self._stream.log(TABLE, rr.TextDocument(table_text(table)))
        for spot in spots:
            self._stream.log(at.under(WIDTH, str(spot.laser_id)), rr.Scalars(spot.width_px))
            self._stream.log(at.under(PEAK, str(spot.laser_id)), rr.Scalars(spot.peak_dn))

    def close(self) -> None:
        """Flush what is logged; the viewer keeps it."""
        self._stream.close()


def _named(one: AimReading) -> Spot | None:
    return None if one.spot is None else replace(one.spot, laser_id=one.laser_id)


def aim_layout(rig: Rig) -> rrb.Blueprint:
    """Layout of aiming, one screen."""
    upper = rrb.Horizontal(
        layout.frame_view(rig, name="Brightest of all lasers, contrast stretched"),
        layout.crops_view(rig),
        column_shares=[4, 5],
    )
    last = rrb.VisibleTimeRange(
        at.CAPTURE,
        start=rrb.TimeRangeBoundary.cursor_relative(seq=-SHOWN_ROUNDS),
        end=rrb.TimeRangeBoundary.cursor_relative(seq=0),
    )
    curves = rrb.Vertical(
        layout.curves_view(WIDTH, "Width of each spot [px]", shown=last),
        layout.curves_view(PEAK, "Peak of each spot [DN]", shown=last),
    )
    lower = rrb.Horizontal(layout.table_view(TABLE, "Table"), curves, column_shares=[3, 2])
    return rrb.Blueprint(
        rrb.Vertical(upper, lower, row_shares=[4, 3]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=at.CAPTURE, play_state="following"),
        auto_layout=False,
        auto_views=False,
    )
