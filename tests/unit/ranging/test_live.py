"""`workbench range --rig` on the virtual bench: readings, how it ends, and the lasers off after every end."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.sensors import calibration_of
from workbench import emulator
from workbench.calibration.verdict.export import write_calibration
from workbench.cli.main import main
from workbench.cli.range import range_captures
from workbench.cli.stopping import SIGNALS
from workbench.devices.protocols import Frame
from workbench.devices.watched import PATIENCE_S
from workbench.emulator.bench import EmulatedBench
from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.controller import Controller
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError, RigNotReadyError
from workbench.model.rig import Rig, load_rig
from workbench.ranging.live import latency_text
from workbench.ranging.ranger import Ranger
from workbench.session.manifest import create_session

ROOT = Path(__file__).parents[3]
RIG = ROOT / "rigs/thesis-emulated.yaml"
Grab = Callable[[EmulatedCamera], Frame]


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "calibration.yaml"
    write_calibration(path, calibration_of(load_rig(RIG)))
    return path


@dataclass
class Ended:
    code: int
    out: list[str]
    err: str
    after_s: float


@dataclass
class Live:
    """The command in this process, with a look behind the port of the virtual bench that it opens."""

    calibration: Path
    monkeypatch: pytest.MonkeyPatch
    capsys: pytest.CaptureFixture[str]
    controllers: list[Controller] = field(default_factory=list)

    def __call__(self, *arguments: object, rig: Path = RIG) -> Ended:
        command = ["workbench", "range", "--rig", rig, "--calibration", self.calibration, *arguments]
        self.monkeypatch.setattr(sys, "argv", [str(word) for word in command])
        began, code = time.monotonic(), 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 0
        said = self.capsys.readouterr()
        assert "Traceback" not in said.err
        return Ended(code, said.out.splitlines(), " ".join(said.err.split()), time.monotonic() - began)

    def dark(self) -> bool:
        return bool(self.controllers) and all(c.lit() == () for c in self.controllers)


@pytest.fixture
def live(
    calibration: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Live]:
    before = {number: signal.getsignal(number) for number in SIGNALS}
    live = Live(calibration, monkeypatch, capsys)

    def look(rig: Rig, folder: Path) -> EmulatedBench:
        bench = emulator.open_bench(rig, folder)
        live.controllers.append(bench.controller)
        return bench

    monkeypatch.setattr(emulator, "DRIVER", replace(emulator.DRIVER, open=look))
    yield live
    for number, handler in before.items():
        signal.signal(number, handler)


def from_the(nth: int, instead: Grab, monkeypatch: pytest.MonkeyPatch) -> None:
    """The camera's n-th frame and those after it are asked of `instead`."""
    really_grab, count = EmulatedCamera.grab, iter(range(1, 10_000))

    def grab(camera: EmulatedCamera) -> Frame:
        return really_grab(camera) if next(count) < nth else instead(camera)

    monkeypatch.setattr(EmulatedCamera, "grab", grab)


def test_as_many_readings_as_asked_for(live: Live) -> None:
    ended = live("--readings", 3, "--standoff", 600, "--json", "--stats")
    assert ended.code == 0
    readings = [json.loads(line) for line in ended.out]
    assert [(r["scene"], r["status"]) for r in readings] == [("0", "done"), ("1", "done"), ("2", "done")]
    for r in readings:
        nearest, farthest = r["interval_mm"]
        # Placed with 0.3 mm, by a ruler that is 0.05 % wrong: 1.3 mm beyond the interval is 4 sigma of that.
        assert nearest - 1.3 < 600.0 < farthest + 1.3
        assert r["shape"]["kind"] in {"flat", "incline"}
        assert len(r["lasers"]) == 4
    assert "3 readings in" in ended.err
    assert "p50" in ended.err
    assert "p99" in ended.err
    assert "of 3 readings only" in ended.err
    assert live.dark()


def test_a_line_of_words_for_each(live: Live) -> None:
    ended = live("--readings", 1, "--standoff", 600)
    (line,) = ended.out
    assert line.startswith("0  done  ")
    assert "mm  flat (1 sigma)  L1 " in line or "mm  incline" in line


def test_nothing_before_the_sensor(live: Live) -> None:
    ended = live("--readings", 2)
    assert ended.err.count("--standoff MM") == 1
    assert ended.code == 0
    assert ended.out == ["0  no_points  no spot was seen", "1  no_points  no spot was seen"]


@pytest.mark.real_time
def test_a_camera_that_hangs_ends_it_within_two_seconds(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    """It hangs at the sixth frame, with the lasers lit: a dark one comes before the first pair."""
    released, hung_at = threading.Event(), list[float]()

    def hang(camera: EmulatedCamera) -> Frame:
        hung_at.append(time.monotonic())
        released.wait(30)
        raise RigNotReadyError("released")

    from_the(6, hang, monkeypatch)
    ended = live("--standoff", 600, "--stats")
    after = time.monotonic() - hung_at[0]
    released.set()
    assert (ended.code, len(ended.out)) == (4, 2)
    assert f"camera: expected an answer within {PATIENCE_S:g} s" in ended.err
    assert "2 readings in" in ended.err
    assert after < 2.0
    assert live.dark()


def test_a_camera_that_never_starts_fires_nothing(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(camera: EmulatedCamera) -> Frame:
        raise RigNotReadyError("camera: no such device")

    asked = list[bytes]()
    really_receive = Controller.receive

    def receive(controller: Controller, data: bytes) -> bytes:
        asked.append(data)
        return really_receive(controller, data)

    monkeypatch.setattr(Controller, "receive", receive)
    from_the(1, fail, monkeypatch)
    assert live("--standoff", 600).code == 4
    assert asked
    assert not any(b"MASK" in request or b"ON" in request for request in asked)


def test_a_camera_that_fails_ends_it(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(camera: EmulatedCamera) -> Frame:
        raise RigNotReadyError("camera: unplugged")

    from_the(4, fail, monkeypatch)
    ended = live("--standoff", 600)
    assert (ended.code, len(ended.out)) == (4, 1)
    assert "camera: unplugged" in ended.err
    assert live.dark()


@pytest.mark.parametrize(("number", "readings"), [(signal.SIGINT, 2), (signal.SIGTERM, 1)])
def test_a_signal_ends_it(
    live: Live, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, readings: int
) -> None:
    """Amid the second reading: Ctrl-C lets it end, SIGTERM does not."""
    really_grab = EmulatedCamera.grab

    def stop(camera: EmulatedCamera) -> Frame:
        os.kill(os.getpid(), number)
        monkeypatch.setattr(EmulatedCamera, "grab", really_grab)
        return really_grab(camera)

    from_the(4, stop, monkeypatch)
    ended = live("--standoff", 600, "--stats")
    assert (ended.code, len(ended.out)) == (5, readings)
    assert f"stopped by {'Ctrl-C' if number == signal.SIGINT else number.name}" in ended.err
    assert f"{readings} readings in" in ended.err
    assert live.dark()


def test_a_driver_s_own_defect_leaves_no_laser_on(
    live: Live, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stumble(camera: EmulatedCamera) -> Frame:
        raise ZeroDivisionError

    from_the(1, stumble, monkeypatch)
    with pytest.raises(AssertionError, match="Traceback"):  # a defect shows as one
        live("--standoff", 600)
    assert live.dark()


def test_a_beam_that_stays_on_is_seen(live: Live, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(RIG.read_text() + "  controller: {fault: hides_stuck_beam}\n")
    ended = live("--standoff", 600, rig=rig)
    assert ended.code == 7
    assert "A beam may be on" in ended.err
    assert "latency_frames" in ended.err
    assert "measure_latency" not in ended.err, "a step of procedures, which ranging has none of"


def test_one_beam_that_stays_on_is_seen_among_the_others(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    """L1 shorts when it is first lit; the difference of every pair shows L2, L3 and L4 only."""
    lit, shorted = Controller.lit, list[bool]()

    def lit_with_a_short(self: Controller) -> tuple[str, ...]:
        if "L1" in lit(self):
            shorted.append(True)
        return tuple(sorted({*lit(self), *(["L1"] if shorted else [])}))

    monkeypatch.setattr(Controller, "lit", lit_with_a_short)
    ended = live("--readings", 2, "--standoff", 600)
    assert (ended.code, ended.out) == (7, [])
    assert "reading 0: the frame with all lasers off shows a spot" in ended.err


@pytest.mark.parametrize("lamp_from", [1, 2])
def test_a_lamp_is_known_if_it_burned_before_the_first_pair(
    live: Live, monkeypatch: pytest.MonkeyPatch, lamp_from: int
) -> None:
    rows, columns = np.mgrid[0:480, 0:640]
    (u, v), *_ = Ranger(load_calibration(live.calibration)).sensor.spot_px("L1", np.array([600.0]))
    glow = 120.0 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 1.5**2))
    really_grab = EmulatedCamera.grab

    def with_a_lamp(camera: EmulatedCamera) -> Frame:
        frame = really_grab(camera)
        return replace(frame, image=np.clip(frame.image + glow, 0, 255).astype(np.uint8))

    from_the(lamp_from, with_a_lamp, monkeypatch)
    ended = live("--readings", 1)
    if lamp_from == 1:
        assert ended.code == 0
        (line,) = ended.out
        assert "no_points" in line
        assert "a light at" in line
        assert "warning: a light at" in ended.err
    else:
        assert (ended.code, ended.out) == (7, [])


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        (
            "rig: thesis-emulated",
            "rig: another",
            "rig: expected that of this rig, another, got thesis-emulated",
        ),
        (
            "serial: emulated-1",
            "serial: emulated-9",
            "serial: expected that of this rig, emulated-9, got emulated-1",
        ),
        (
            "width_px: 640",
            "width_px: 320",
            "(320, 480), got (640, 480)",
        ),
        ("  - id: L4", "  - id: L5", "list of lasers"),
    ],
)
def test_the_calibration_of_another_sensor(
    live: Live, tmp_path: Path, was: str, becomes: str, words: str
) -> None:
    text = RIG.read_text()
    assert was in text
    rig = tmp_path / "rig.yaml"
    rig.write_text(text.replace(was, becomes))
    ended = live(rig=rig)
    assert (ended.code, ended.out) == (2, [])
    assert words in ended.err
    assert live.controllers == []


@pytest.mark.parametrize(("serial", "refused"), [("emulated-1", False), ("emulated-9", True)])
def test_a_session_of_another_sensor(calibration: Path, tmp_path: Path, serial: str, refused: bool) -> None:
    rig_file, folder = tmp_path / "rig.yaml", tmp_path / "session"
    rig_file.write_text(RIG.read_text().replace("serial: emulated-1", f"serial: {serial}"))
    create_session(
        folder, load_rig(rig_file), rig_file, [], operator="", created="2026-01-01T00:00:00Z", command="test"
    )
    (folder / "captures.csv").write_text("laser_id,standoff_mm,repeat,u_px,v_px\nL1,,0,250,240\n")
    if refused:
        with pytest.raises(BadInputError, match=r"serial.*emulated-9"):
            range_captures(folder, calibration, as_json=False)
    else:
        range_captures(folder, calibration, as_json=False)


def test_usage(live: Live, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    assert live(captures).code == 2
    for arguments in (["--readings", "0"], ["--standoff", "-3"]):
        assert live(*arguments).code == 2
    assert live.controllers == []


def test_latencies_are_told_by_their_percentiles_in_milliseconds() -> None:
    words = latency_text(np.linspace(0.001, 0.201, 201).tolist(), 20.1)
    for number in ("201 readings", "20.1 s", "10.0 a second", "p50 101.00 ms", "p99 199.00 ms"):
        assert number in words
    assert latency_text([], 1.0)
