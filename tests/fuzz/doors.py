"""Doors of the workbench in this process: each reads a file, or refuses it by an error of the project."""

from __future__ import annotations

import math
import os
import random
import resource
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from tests.fuzz.mutation import edited_documents, edited_texts, mutate_bytes
from tests.fuzz.outcome import Outcome
from tests.support.camera_files import KALIBR, MESSAGE, MRCAL, ROS
from workbench.corners.board import find_board
from workbench.model.board import Board
from workbench.model.calibration import load_calibration
from workbench.model.camera_source import read_intrinsics
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError, WorkbenchError
from workbench.model.intrinsics import camera_values, for_image
from workbench.model.prompt import Prompt, Quantity
from workbench.model.rig import load_rig
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.operator import NoOperator, ScriptedOperator
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.session.frames import read_image
from workbench.session.journal import JOURNAL, read_journal
from workbench.session.manifest import MANIFEST, load_manifest, load_session_rig
from workbench.session.state import effective, placement_captures, safe_part, session_status
from workbench.trials.any_sensor.readings_file import load_readings

ROOT = Path(__file__).parents[2]
SESSION = ROOT / "data/session-0.1.0"
MOST_CPU_S = 20.0
MOST_BYTES = 2**30
"""Largest memory of a process that reads one input; the program itself takes `OWN_BYTES`."""
OWN_BYTES = 300 * 2**20
BY_HYPOTHESIS = 0.2
"""Share of a door's inputs that hypothesis makes; it takes milliseconds for each."""


@dataclass(frozen=True)
class Door:
    """One kind of input."""

    name: str
    file: str
    """Name that the mutated file has."""
    seeds: tuple[bytes, ...]
    """Good inputs."""
    read: Callable[[Path], object]
    """Reader of the file; refuses it by a WorkbenchError."""
    weight: int
    """Share of the inputs; the readers take from 20 microseconds to 20 ms."""


def knock(door: Door, folder: Path, content: bytes, outcome: Outcome) -> None:
    """Read one input at a door."""
    path = folder / door.file
    path.write_bytes(content)
    started, before = time.process_time(), _peak_bytes()
    try:
        door.read(path)
        outcome.results["read"] += 1
    except WorkbenchError as error:
        outcome.results["refused"] += 1
        if not str(error).strip():
            outcome.found.setdefault("an error without a message", content)
    except Exception as error:  # any other than the program's own errors is what is looked for
        outcome.results["failed"] += 1
        last = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in last if "/workbench/" in frame.filename] or list(last)
        outcome.found.setdefault(f"{type(error).__name__} at {own[-1].filename}:{own[-1].lineno}", content)
    if time.process_time() - started > MOST_CPU_S:
        outcome.found.setdefault(f"more than {MOST_CPU_S:g} s", content)
    if _peak_bytes() - before > MOST_BYTES - OWN_BYTES:  # a worker of the tests may be large already
        outcome.found.setdefault(f"more than {MOST_BYTES / 2**20:g} MiB", content)


def _peak_bytes() -> int:
    """Largest memory that this process has used so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def fuzz(door: Door, folder: Path, count: int, number: int, end_s: float = math.inf) -> Outcome:
    """Read `count` mutated inputs at a door, the same for the same seed `number`; fewer where time is over.

    Args:
        door: the door.
        folder: empty folder for the inputs.
        count: number of inputs.
        number: seed.
        end_s: time of the monotonic clock after which no further input is read, s.
    """
    outcome = Outcome()
    for content in door.seeds:
        knock(door, folder, content, outcome)
    assert outcome.results["read"] == len(door.seeds), f"{door.name}: a good input is refused"
    rng = random.Random(number)  # noqa: S311 - no secret

    def take(content: bytes) -> None:
        if time.monotonic() < end_s:
            knock(door, folder, content, outcome)

    by_hypothesis = int(BY_HYPOTHESIS * count)
    example = rng.choice(door.seeds)
    kinds = _kinds(door, example)
    for kind in kinds:
        _draw(kind(example), by_hypothesis // len(kinds), number, take)
    while outcome.run < count and time.monotonic() < end_s:
        take(mutate_bytes(door.seeds, rng))
    return outcome


def _kinds(door: Door, example: bytes) -> tuple[Callable[[bytes], SearchStrategy[bytes]], ...]:
    """Mutations by hypothesis: none of images, whose bytes are no text.

    A document of tagged values (OpenCV's) is edited as text: its values without their tags mean nothing.
    """
    if door.file.endswith(".png"):
        return ()
    is_text = door.file.endswith(".csv") or b"!!" in example
    return (edited_texts,) if is_text else (edited_texts, edited_documents)


def _draw(inputs: SearchStrategy[bytes], count: int, number: int, take: Callable[[bytes], None]) -> None:
    """Pass `count` examples of a strategy on."""

    @seed(number)
    @settings(
        max_examples=max(1, count),
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(inputs)
    def one(content: bytes) -> None:
        take(content)

    one()


PROMPTS = {
    "place": Prompt("place", "Place it.", quantity=Quantity("mm", 450.0, 550.0, 500.0)),
    "card": Prompt("card", "Which card?", choices=("1", "yes")),
    "safety": Prompt("safety", "Safe?", at_bench=True),
}
ANSWERS = b"safety: yes\nplace: 500.5\ncard: '1'\n"
RIG = b"""format: 1
rig: small
serial: s1
camera: {width_px: 64, height_px: 48, bits: 8, f_px: {value: 60.0, sd: 6.0}, cx_px: {value: 31.5, sd: 3.0},
  cy_px: {value: 23.5, sd: 3.0}, k1: {value: 0.0, sd: 0.1}}
lasers:
  - {id: L1, axis: u, x_mm: {value: -60.0, sd: 0.2}, y_mm: {value: 0.0, sd: 0.2}, tx: {value: 0.0, sd: 0.01}}
  - {id: L2, axis: v, x_mm: {value: 0.0, sd: 0.2}, y_mm: {value: 30.0, sd: 0.2}}
devices:
  camera: {driver: opencv, source: "0", exposure: 20.0, exposure_limits: [5, 200]}
  lasers: {driver: serial, port: /dev/ttyACM0}
bench: {offset_mm: {value: 0.0, sd: 5.0}, placement_sd_mm: 0.3, reach_mm: [100, 2000]}
noise: {spot_sd_px: 0.05, speckle_sd_px: 0.04}
"""
PROCEDURE = b"""format: 1
procedure: small
title: Small
steps:
  - {step: message, text: hello}
  - step: capture_grid
    standoffs_mm: [150, 300, 600, 1200]
    repeats: 3
  - {step: fit, limits: {max_relative_range_sd: 0.05}}
"""
CAPTURES = (
    b"laser_id,standoff_mm,repeat,u_px,v_px\nL1,150,0,106.731,241.141\nL1,150,1,106.73,\nL4,300,0,,240.062\n",
    b'laser_id, standoff_mm, repeat, on, off, scene\nall,,0,a-on.png,a-off.png,s1\nL1,"150",0,b.png,,s2\n',
    b"sep=,\r\nlaser_id,standoff_mm,repeat,u_px,v_px,u_sd_px,tilt_deg,placement,,\r\nL1,1.5e2,0,1,2,0.1,3,p,,\r\n",
)
READINGS = (b"true_mm,measured_mm,session,repeat\n100,101.2,a,0\n100,100.8,a,1\n200,199.5,b,0\n200,,b,1\n",)


CAMERAS = (
    ROS.encode(),
    MESSAGE.encode(),
    MRCAL.encode(),
    KALIBR.partition("cam1:")[0].encode(),
    (ROOT / "data/opencv-chessboards/left_intrinsics.yml").read_bytes(),
)


def _png(kind: str, levels: int) -> bytes:
    values = np.random.default_rng(1).integers(0, levels, (12, 16))
    image = values.astype(np.uint8) if levels <= 256 else values.astype(np.uint16)
    return bytes(cv2.imencode(kind, image)[1])


def _board() -> bytes:
    """The upper block of the printed board, as printed."""
    board = Board()
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    size = (board.columns, board.rows)
    block = cv2.aruco.CharucoBoard(
        size, board.square_mm, board.marker_mm, dictionary, np.arange(board.markers)
    )
    image = block.generateImage((30 * board.columns, 30 * board.rows), marginSize=10)
    return bytes(cv2.imencode(".png", cv2.GaussianBlur(image, (0, 0), 1.0))[1])


def _colour(kind: str) -> bytes:
    return bytes(cv2.imencode(kind, np.full((12, 16, 3), (9, 99, 199), np.uint8))[1])


def _read_rig(path: Path) -> None:
    found = check_file(path)
    try:
        load_rig(path)
    except BadInputError:
        assert found.mistakes, "the check finds no mistake, and the rig cannot be read"
        raise


def _read_procedure(path: Path) -> None:
    found = check_file(path)
    load_procedure(path)
    if found.mistakes:
        raise BadInputError("\n".join(found.mistakes))


def _read_session(path: Path) -> None:
    session_status(path.parent)
    records = effective(read_journal(path.parent))
    placement_captures(records)
    safe_part(records)


def _read_manifest(path: Path) -> None:
    load_manifest(path.parent)
    load_session_rig(path.parent)


def _read_answers(path: Path) -> None:
    ScriptedOperator.load(path, PROMPTS, NoOperator("no terminal"))


def _read_camera(path: Path) -> None:
    found = read_intrinsics(path)
    camera_values(for_image(found, found.size_px or (640, 480)))


def _read_board(path: Path) -> None:
    find_board([read_image(path)], Board())


def doors() -> tuple[Door, ...]:
    """Every door that reads a file."""
    grey = (_png(kind, 256) for kind in (".png", ".jpg", ".bmp", ".tiff", ".webp", ".pgm"))
    images = (*grey, _png(".png", 4096), *(_colour(kind) for kind in (".png", ".jpg", ".tiff")))
    journal = (SESSION / JOURNAL).read_bytes().splitlines(keepends=True)
    return (
        Door("rig", "rig.yaml", (RIG, (ROOT / "rigs/webcam-laser.yaml").read_bytes()), _read_rig, 20),
        Door("procedure", "procedure.yaml", (PROCEDURE,), _read_procedure, 40),
        Door("calibration", "c.yaml", ((SESSION / "calibration.yaml").read_bytes(),), load_calibration, 5),
        Door("manifest", MANIFEST, ((SESSION / MANIFEST).read_bytes(),), _read_manifest, 10),
        Door(
            "answers", "a.yaml", (ANSWERS,), lambda p: ScriptedOperator.load(p, PROMPTS, NoOperator("-")), 80
        ),
        Door("journal", JOURNAL, (b"".join(journal[:12]), b"".join(journal)), _read_session, 100),
        Door("captures", "captures.csv", CAPTURES, load_captures, 400),
        Door("readings", "readings.csv", READINGS, load_readings, 100),
        Door("camera", "camera.yaml", CAMERAS, _read_camera, 20),
        Door("image", "image.png", images, read_image, 1000),
        Door("board image", "board.png", (_board(),), _read_board, 10),
    )


def fuzz_part(name: str, count: int, number: int, end_s: float) -> Outcome:
    """`fuzz` of a door by its name, in a folder of its own; nothing after `end_s`."""
    if time.monotonic() >= end_s:
        return Outcome()
    door = next(door for door in doors() if door.name == name)
    with tempfile.TemporaryDirectory() as folder:
        return fuzz(door, Path(folder), count, number, end_s)


def counts(total: int) -> dict[str, int]:
    """Number of inputs of each door."""
    every = doors()
    weight = sum(door.weight for door in every)
    return {door.name: -(-total * door.weight // weight) for door in every}


def shares(count: int, parts: int) -> Iterator[int]:
    """`count` in `parts` nearly equal numbers."""
    yield from (count // parts + (n < count % parts) for n in range(parts))


def quiet_decoders() -> None:
    """Send what C libraries write about damaged images to /dev/null."""
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 2)
