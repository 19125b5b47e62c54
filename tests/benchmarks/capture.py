"""Cost of a capture beyond the camera's own frames: a session with a camera that waits for nothing."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
from rich.console import Console

from tests.support.plain_bench import PlainLasers, plain_bench
from tests.support.rigs import PROVENANCE
from tests.support.running import Scripted
from workbench.cli.background import Background
from workbench.devices.protocols import Bench, Frame
from workbench.model import event as ev
from workbench.model.rig import Rig, load_rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.session.files import write_record
from workbench.session.journal import Journal
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

RIG = Path(__file__).parents[2] / "rigs" / "thesis-emulated.yaml"
STANDOFFS_MM = (280.0, 600.0)
REPEATS = 25
ROUNDS = 3


@dataclass
class StoredCamera:
    """Frames of the virtual bench, rendered when they are first asked for and stored."""

    bench: Bench
    frames: dict[tuple[object, ...], list[Frame]] = field(default_factory=dict)
    variants: int = 3
    """Different frames of one scene."""
    number: int = 0
    where: float = 0.0
    """Standoff of the target, mm."""

    def grab(self) -> Frame:
        """The scene's next stored frame."""
        lasers = self.bench.lasers
        assert isinstance(lasers, PlainLasers)
        scene = self.frames.setdefault((self.where, lasers.on), [])
        if len(scene) < self.variants:
            scene.append(self.bench.camera.grab())
        self.number += 1
        return replace(scene[self.number % len(scene)], time_ns=time.time_ns())

    def grab_ambient(self) -> Frame:
        """A frame with all lasers off."""
        return self.grab()

    def close(self) -> None:
        """Nothing is held."""


def cost_ms(rig: Rig, camera: StoredCamera, *, recorded: bool) -> float:
    """Time of one capture of a session, with or without its recording, ms."""
    with tempfile.TemporaryDirectory() as folder:
        session = Path(folder) / "s"
        session.mkdir()
        beside = _recording(session, rig) if recorded else nullcontext()
        bench = replace(camera.bench, camera=camera)
        taken = 0
        with beside as consumer, Journal(session) as journal:
            consumers = [] if consumer is None else [consumer]
            recorder = ReplayingJournal(journal, consumers)
            context = Context(session, rig, bench, Scripted(), recorder, PROVENANCE, lambda: None)
            context.emit(ev.SessionStarted(session="s", rig=rig.rig, procedures=("p",)))
            context.pairs.may_emit = True
            start = time.perf_counter()
            for standoff_mm in STANDOFFS_MM:
                placement = Placement(key=f"p/{standoff_mm:g}mm", standoff_mm=standoff_mm)
                camera.where = bench.target.place(placement).standoff_mm
                taken += capture_lasers(context, placement, REPEATS)
            duration = time.perf_counter() - start
    return 1e3 * duration / taken


def _recording(session: Path, rig: Rig) -> Background:
    return Background(RecordingConsumer(session, rig), session / RECORDING_FILE, Console(quiet=True))


def parts_ms(camera: StoredCamera) -> tuple[float, float]:
    """Time to encode the frames of a capture, and to write them, ms."""
    images = [frame.image for frames in camera.frames.values() for frame in frames]
    start = time.perf_counter()
    contents = [cv2.imencode(".png", image)[1].tobytes() for image in images]
    encoded = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        for number, content in enumerate(contents):
            write_record(Path(folder) / f"{number}.png", content)
    written = time.perf_counter()
    return 2e3 * (encoded - start) / len(images), 2e3 * (written - encoded) / len(images)


def lines() -> Iterator[str]:
    """The table, line by line."""
    rig = load_rig(RIG)
    with tempfile.TemporaryDirectory() as folder, plain_bench(rig, Path(folder)) as bench:
        camera = StoredCamera(bench)
        cost_ms(rig, camera, recorded=False)  # renders the frames, compiles the search
        alone = min(cost_ms(rig, camera, recorded=False) for _ in range(ROUNDS))
        recorded = [cost_ms(rig, camera, recorded=True) for _ in range(ROUNDS)]
        encode, write = parts_ms(camera)
    count = len(STANDOFFS_MM) * REPEATS * len(rig.lasers)
    size = f"{rig.camera.width_px} x {rig.camera.height_px}"
    yield f"Time of a capture beyond the camera's frames, ms: {count} captures, {size}, both frames kept"
    yield "Target: at most 30 with the recording."
    yield f"  without recording              {alone:6.1f}"
    yield f"  with recording, best of {ROUNDS}      {min(recorded):6.1f}   worst {max(recorded):.1f}"
    yield f"  of these: encoding both frames {encode:6.1f}   writing them {write:.1f}"


if __name__ == "__main__":
    print("\n".join(lines()))
