"""Cost of the recording: size over that of its frames, share of a core at 30 captures a second, latency."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from tests.benchmarks.capture import RIG, StoredCamera
from tests.support.plain_bench import plain_bench
from workbench.cli.background import Background
from workbench.devices.protocols import Bench
from workbench.model import event as ev
from workbench.model.rig import Rig, load_rig
from workbench.model.target import Placement
from workbench.procedure.capture.pair import spots_found
from workbench.session.frames import FrameStore
from workbench.spots import find_spots
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

RATE_HZ = 30.0
CAPTURES = 300
"""10 s at that rate: the first frames, when Rerun starts, are among them."""
SETTLE = 30
"""Captures before the share of a core is measured: styles, fonts and the first pictures."""
STANDOFF_MM = 600.0
SIZE_LIMIT, CORE_LIMIT, LATENCY_LIMIT_MS = 1.2, 0.20, 20.0


@dataclass(frozen=True)
class Cost:
    """Cost of one recording."""

    core_share: float
    """Processor time of the recording's threads over the time, without the finding of spots."""
    worst_ms: float
    """Longest delay of a capture: by the interpreter's lock, and until its records are passed on."""
    mean_ms: float
    frames_bytes: int
    recording_bytes: int


def measure(rig: Rig, events: Sequence[tuple[ev.CaptureTaken, ev.SpotsFound]], session: Path) -> Cost:
    """Record captures at `RATE_HZ`, as a session passes them, and measure."""
    consumer = RecordingConsumer(session, rig)
    waits: list[float] = []
    numbers = iter(range(10**6))

    def pass_on(event: ev.Event) -> None:
        record = ev.Record(n=next(numbers), time_ns=time.time_ns(), event=event)
        beside(record)

    with Background(consumer, session / RECORDING_FILE, Console(quiet=True)) as beside:
        pass_on(ev.SessionStarted(session="s", rig=rig.rig, procedures=("p",)))
        pass_on(ev.StepStarted(procedure="p", index=1, step="g", title="Captures", shots=len(events)))
        pass_on(ev.TargetPlaced(placement=Placement(key="p/1", standoff_mm=STANDOFF_MM)))
        clock = threading.Event()  # its wait keeps the rate
        due = time.perf_counter()
        for number, (taken, found) in enumerate(events):
            if number == SETTLE:
                cpu, began, waits = time.process_time(), time.perf_counter(), []
            clock.wait(max(0.0, due - time.perf_counter()))
            pass_on(taken)
            pass_on(found)
            waits.append(time.perf_counter() - due)
            due += 1.0 / RATE_HZ
        share = (time.process_time() - cpu) / (time.perf_counter() - began)
    frames = sum((session / taken.on.path).stat().st_size for taken, _ in events)
    return Cost(
        share,
        1e3 * max(waits),
        1e3 * sum(waits) / len(waits),
        frames,
        (session / RECORDING_FILE).stat().st_size,
    )


def captures(
    rig: Rig, bench: Bench, camera: StoredCamera, session: Path
) -> list[tuple[ev.CaptureTaken, ev.SpotsFound]]:
    """Captures of each laser in turn with their spots, stored as a session stores them.

    One picture of each scene recurs, so that `recent_image` has all of them, as in a session, without storing
    at the same time.
    """
    camera.where = bench.target.place(Placement(key="p/1", standoff_mm=STANDOFF_MM)).standoff_mm
    store, taken = FrameStore(session), []
    found: dict[tuple[int, int], ev.SpotsFound] = {}
    for number in range(CAPTURES):
        laser = rig.laser_ids[number % len(rig.laser_ids)]
        key = f"p/1/{laser}/{number:03d}"
        with bench.lasers.lit([laser], for_s=1.0):
            on = camera.grab()
        off = camera.grab()
        pair = id(on.image), id(off.image)
        if pair not in found:
            found[pair] = spots_found(key, find_spots(on.image, off.image, expected=1), [laser])
        event = ev.CaptureTaken(
            key=key,
            purpose="calibration",
            laser_id=laser,
            placement_key="p/1",
            standoff_mm=STANDOFF_MM,
            repeat=number,
            on=store.save(key, "on", on.image, on.time_ns),
            off=store.save(key, "off", off.image, off.time_ns),
        )
        taken.append((event, found[pair].model_copy(update={"key": key})))
    return taken


def lines() -> Iterator[str]:
    """The table, line by line."""
    rig = load_rig(RIG)
    with tempfile.TemporaryDirectory() as folder, plain_bench(rig, Path(folder)) as bench:
        camera = StoredCamera(bench, variants=1)
        session = Path(folder) / "s"
        session.mkdir()
        cost = measure(rig, captures(rig, bench, camera, session), session)
    ratio = cost.recording_bytes / cost.frames_bytes
    size = f"{rig.camera.width_px} x {rig.camera.height_px}"
    yield f"Recording of {CAPTURES} captures at {RATE_HZ:g} Hz, {size}, processor time of all threads"
    yield f"  size over that of its frames      {ratio:6.2f}    target: at most {SIZE_LIMIT:g}"
    share, most = 100 * cost.core_share, 100 * CORE_LIMIT
    yield f"  share of a core                   {share:6.1f} %  target: at most {most:g} %"
    yield (
        f"  latency added to a capture, worst {cost.worst_ms:6.1f} ms target: at most {LATENCY_LIMIT_MS:g};"
        f" mean {cost.mean_ms:.2f} ms"
    )


if __name__ == "__main__":
    print("\n".join(lines()))
