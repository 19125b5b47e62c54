"""`workbench range --rig`: readings from a bench, up to a number of readings or a signal."""

from __future__ import annotations

import json
import tempfile
import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.cli.console import print_message
from workbench.cli.in_force import note_if_not_in_force, sessions_of
from workbench.cli.live_window import LiveWindow, watching
from workbench.cli.reading_json import plain
from workbench.cli.stopping import StopAfterCapture
from workbench.devices.protocols import Bench
from workbench.devices.registry import load_bench_rig, open_bench
from workbench.devices.watched import watched
from workbench.model.arrays import Image
from workbench.model.errors import StoppedError
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.model.target import Placement
from workbench.ranging.live import LiveRanger, latency_text
from workbench.ranging.ranger import Ranger, Reading
from workbench.report.readings import reading_line
from workbench.sensor.usable import check_same_sensor, load_usable

if TYPE_CHECKING:  # loads Rerun
    from workbench.viewer.ranger_view import Shown
    from workbench.viewer.stream import Stream

FIXED_EXPOSURE = (
    "the camera keeps the exposure of the rig file; a reading with a clipped spot has a note; `workbench"
    " doctor` measures a suitable exposure at 500 mm"
)
"""Sessions set the exposure at each placement; live ranging does not know when the target has moved."""


@dataclass(frozen=True)
class LiveRequest:
    """Arguments of the command."""

    rig: Path
    calibration: Path
    readings: int | None
    """Number of readings; None: until a signal."""
    standoff_mm: float | None
    """Standoff at which the bench's target is placed first; None: not placed."""
    stats: bool
    """Whether to print the latency at the end."""
    view: bool = False
    """Whether to show the readings in the viewer."""


def range_live(request: LiveRequest, as_json: bool) -> None:
    """Take readings and print one line for each on standard output.

    Raises:
        BadInputError: a file is wrong, or the calibration belongs to another sensor.
        RigNotReadyError: a device does not answer.
        StoppedError: a signal was received.
        LaserOffNotConfirmedError: a beam may be on.
    """
    rig, calibration = load_bench_rig(request.rig), load_usable(request.calibration)
    check_same_sensor(rig, calibration)
    note_if_not_in_force(request.calibration, calibration, sessions_of(request.calibration))
    stopping = StopAfterCapture()
    # A bench may need a session folder for its files; live ranging keeps none.
    with (
        tempfile.TemporaryDirectory(prefix="workbench-range-") as folder,
        watched(open_bench(rig, Path(folder) / "live")) as bench,
    ):
        ranger = Ranger(calibration)
        with _window(rig, ranger) if request.view else nullcontext() as window:
            _read_all(bench, ranger, request, as_json, stopping, window)


def _read_all(
    bench: Bench,
    ranger: Ranger,
    request: LiveRequest,
    as_json: bool,
    stopping: StopAfterCapture,
    window: LiveWindow[Shown] | None,
) -> None:
    live = LiveRanger(ranger, bench)
    live.warm_up()
    if not bench.virtual:
        print_message(f"note: {FIXED_EXPOSURE}")
    if request.standoff_mm is not None:
        bench.target.place(Placement(key="live", standoff_mm=request.standoff_mm))
    for warning in live.get_ready():
        print_message(f"warning: {warning}")
    began = time.monotonic()
    try:
        for number in count() if request.readings is None else range(request.readings):
            if stopping.reason is not None:
                raise StoppedError(stopping.reason)
            reading = live.read(f"{number}")
            _show(reading, as_json)
            if window is not None and live.seen is not None:
                _draw(window, reading, *live.seen)
            if number == 0 and reading.status == "no_points":
                print_message(f"hint: {_hint_without_spot(request, bench.virtual)}")
    finally:
        if request.stats:
            print_message(latency_text(live.latencies_s, time.monotonic() - began))


def _window(rig: Rig, ranger: Ranger) -> AbstractContextManager[LiveWindow[Shown]]:
    from workbench.viewer.ranger_view import RangerView, ranger_layout

    def view(stream: Stream) -> RangerView:
        return RangerView(stream, rig, ranger)

    return watching(f"range {rig.rig}", ranger_layout(rig), view)


def _draw(
    window: LiveWindow[Shown], reading: Reading, on: Image, off: Image, spots: tuple[Spot, ...]
) -> None:
    from workbench.viewer.ranger_view import Shown

    window.show(Shown(reading, on, off, spots))


def _hint_without_spot(request: LiveRequest, virtual: bool) -> str:
    if virtual and request.standoff_mm is None:
        return "the virtual bench has no target; place one with --standoff MM"
    return "no spot was seen; check that the beams hit a target within range and that the exposure suffices"


def _show(reading: Reading, as_json: bool) -> None:
    # Without lasers the line itself contains the notes.
    notes = "".join(f"\n   {note}" for note in reading.notes if reading.lasers)
    print(json.dumps(plain(reading)) if as_json else reading_line(reading) + notes, flush=True)
