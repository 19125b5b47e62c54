"""`workbench range --rig`: readings from a bench, until as many as asked for or a signal."""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from workbench.cli.console import say
from workbench.cli.range import usable
from workbench.cli.reading_json import plain
from workbench.cli.stopping import StopAfterShot
from workbench.devices.protocols import Bench
from workbench.devices.registry import load_bench_rig, open_bench
from workbench.devices.watched import watched
from workbench.model.errors import StoppedError
from workbench.model.target import Placement
from workbench.ranging.live import LiveRanger, check_same_sensor, latency_text
from workbench.ranging.ranger import Ranger, Reading
from workbench.report.readings import reading_line

FIXED_EXPOSURE = (
    "the camera's exposure stays as the rig file sets it, whatever stands in the beams; a clipped spot"
    " is told with its reading, and `workbench doctor` tells what is right at 500 mm"
)
"""Sessions set it at each placement; here nobody says when the target has moved."""


@dataclass(frozen=True)
class LiveRequest:
    """What the user asked for."""

    rig: Path
    calibration: Path
    readings: int | None
    """None: until a signal."""
    standoff_mm: float | None
    """Have the bench's target placed there first."""
    stats: bool


def range_live(request: LiveRequest, as_json: bool) -> None:
    """Range until the end; a line each on standard output.

    Raises:
        BadInputError: a file is wrong, or the calibration is another sensor's.
        RigNotReadyError: a device does not answer.
        StoppedError: a signal came.
        LaserOffNotConfirmedError: a beam may be on.
    """
    rig, calibration = load_bench_rig(request.rig), usable(request.calibration)
    check_same_sensor(rig, calibration)
    stopping = StopAfterShot()
    # A bench keeps what it must beside its session; live ranging keeps none.
    with (
        tempfile.TemporaryDirectory(prefix="workbench-range-") as folder,
        watched(open_bench(rig, Path(folder) / "live")) as bench,
    ):
        _read_all(bench, Ranger(calibration), request, as_json, stopping)


def _read_all(
    bench: Bench,
    ranger: Ranger,
    request: LiveRequest,
    as_json: bool,
    stopping: StopAfterShot,
) -> None:
    live = LiveRanger(ranger, bench)
    live.warm_up()
    if not bench.virtual:
        say(f"note: {FIXED_EXPOSURE}")
    if request.standoff_mm is not None:
        bench.target.place(Placement(key="live", standoff_mm=request.standoff_mm))
    for warning in live.get_ready():
        say(f"warning: {warning}")
    began = time.monotonic()
    try:
        for number in count() if request.readings is None else range(request.readings):
            if stopping.reason is not None:
                raise StoppedError(stopping.reason)
            reading = live.read(f"{number}")
            _show(reading, as_json)
            if number == 0 and reading.status == "no_points":
                say(f"hint: {_why_nothing(request, bench.virtual)}")
    finally:
        if request.stats:
            say(latency_text(live.latencies_s, time.monotonic() - began))


def _why_nothing(request: LiveRequest, virtual: bool) -> str:
    if virtual and request.standoff_mm is None:
        return "the virtual bench is empty; --standoff MM has a target placed there"
    return "no spot was seen: do the beams end on a target, within range, and is the exposure long enough?"


def _show(reading: Reading, as_json: bool) -> None:
    notes = "".join(f"\n   {note}" for note in reading.notes if reading.lasers)  # else the line has them
    print(json.dumps(plain(reading)) if as_json else reading_line(reading) + notes, flush=True)
