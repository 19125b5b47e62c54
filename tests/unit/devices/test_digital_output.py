"""Lasers on a digital output board: NI's package is faked at its boundary, the guardian is the real one."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.firmware.parts import can_hurry, hurried, hurry
from tests.support.fake_board import changes, write_package
from tests.support.lasers import board_bank
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.devices.guarded_line import TRY_BOARD_S
from workbench.devices.protocols import LaserState
from workbench.devices.registry import load_bench_rig, open_lasers
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[3]
SCRIPT = Path(sys.executable).with_name("workbench")
LINES = "Dev1/port0/line0:3"
IDS = ("L1", "L2", "L3", "L4")
END_MS = 50
HANG_MS = 600
"""The half second of docs/laser-controller.md, and a tenth for guardian and board to do it."""
REPEATS = 3
IN_ITS_WAY = [sys.executable, "-m", "tests.support.starve_process"]
BUSY_S = 0.3
"""Well over `END_MS`, and less than a guardian waits for a beat."""
LIGHT_AND_WAIT = f"""
import time
from workbench.cli.stopping import StopAfterCapture
from tests.support.lasers import board_bank
StopAfterCapture()  # as `workbench run` does
bank = board_bank({LINES!r}, {IDS!r})
with bank.lit(["L2"], for_s=30):
    print("lit", flush=True)
    while True:
        time.sleep(0.05)
        {{beat}}
"""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_package(tmp_path / "lib")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "lib"), str(ROOT)]))
    monkeypatch.setenv("FAKE_BOARD_LOG", str(tmp_path / "lines.log"))
    return tmp_path / "lines.log"


def fail(log: Path, how: str) -> None:
    Path(f"{log}.fault").write_text(how)


def bank(lines: str = LINES) -> GuardedLaserBank:
    return board_bank(lines, IDS)


def masks(log: Path) -> list[int]:
    return [mask for _, mask in changes(log)]


def test_lines_follow_the_lasers_and_end_low(log: Path) -> None:
    lasers = bank()
    assert lasers.identity == "PCI-6503 Dev1, 4 lines"
    assert set(masks(log)) == {0}, "whatever was left high is put low before anything else"
    with lasers.lit(["L1", "L4"], for_s=2.0):
        assert masks(log)[-1] == 0b1001
        assert lasers.state() == LaserState(("L1", "L4"), None)
    assert masks(log)[-1] == 0
    lasers.close()


def test_a_board_of_one_line(log: Path) -> None:
    lasers = board_bank("Dev1/port0/line2", ("L1",))
    with lasers.lit(["L1"], for_s=2.0):
        assert masks(log)[-1] == 1
    assert lasers.state() == LaserState((), None)
    lasers.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGSEGV])
def test_off_when_the_workbench_ends(log: Path, how: signal.Signals) -> None:
    delays = measure(log, "bank.beat()", how)
    assert delays[0] > 0
    assert delays[-1] <= END_MS


@pytest.mark.skipif(not can_hurry(), reason="needs the right to real-time priority")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_off_when_the_workbench_gets_no_turn_to_end(log: Path, how: signal.Signals) -> None:
    """On a busy computer it may stay what it was for long, with its pipes: the guardian sees it coming."""
    delays = []
    for _ in range(REPEATS):
        log.unlink(missing_ok=True)
        with lit_elsewhere("bank.beat()") as process:
            try:
                arguments = [str(process.pid), str(int(how)), str(BUSY_S)]
                said = subprocess.run(
                    [*IN_ITS_WAY, *arguments], stdout=subprocess.PIPE, cwd=ROOT, check=True, timeout=60
                )
                began_ns, still_there = map(int, said.stdout.split())
                assert still_there
                delays.append((wait_for_dark(log) - began_ns) / 1e6)
            finally:
                process.kill()
    print(f"{how.name}, no turn: off after", ", ".join(f"{d:.1f}" for d in delays), "ms")
    assert min(delays) > 0
    assert max(delays) <= END_MS


def test_off_when_the_workbench_hangs(log: Path) -> None:
    """Half a second from the last beat, by the guardian's own clock: a board has no lease."""
    hung = measure(log, "pass", None)
    assert hung[-1] <= HANG_MS


def test_off_at_once_when_the_workbench_is_suspended(log: Path) -> None:
    assert measure(log, "bank.beat()", signal.SIGSTOP)[-1] <= END_MS


def measure(log: Path, beat: str, how: signal.Signals | None) -> list[float]:
    """End `REPEATS` workbenches; how long the lines stayed high after it, ms, in ascending order."""
    delays = []
    for _ in range(REPEATS):
        log.unlink(missing_ok=True)
        with lit_elsewhere(beat) as process:
            with hurried():
                began_ns = time.monotonic_ns()
                if how is not None:
                    process.send_signal(how)
            delays.append((wait_for_dark(log) - began_ns) / 1e6)
            process.kill()
            process.wait(10)
    print(f"{how}, {beat}: off after", ", ".join(f"{d:.1f}" for d in delays), "ms")
    return sorted(delays)


def rig_file(folder: Path, lines: str) -> Path:
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    devices = f"devices:\n  camera: {{source: 0}}\n  lasers: {{driver: nidaqmx, port: '{lines}'}}\n"
    path = folder / "rig.yaml"
    path.write_text(text.replace("driver: emulated", "driver: opencv+serial") + devices)
    return path


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("how", ["unplugged", "broken pipe"])
def test_an_off_that_failed_is_tried_again(log: Path, how: str) -> None:
    """The workbench hangs: nobody but the guardian would put the lasers off once the board is back."""
    with lit_elsewhere("pass") as process:
        fail(log, how)
        time.sleep(1.0)  # the guardian's lease of half a second is over
        assert masks(log)[-1] != 0
        fail(log, "")
        wait_for_dark(log)
        process.kill()


@pytest.mark.parametrize("how", ["unplugged", "broken pipe"])
def test_an_off_that_failed_is_tried_again_when_nobody_is_left(log: Path, how: str) -> None:
    with lit_elsewhere("bank.beat()") as process:
        fail(log, how)
        process.kill()
        process.wait(10)
        time.sleep(2.0)  # longer than a controller with leases of its own is tried
        assert masks(log)[-1] != 0
        fail(log, "")
        wait_for_dark(log)


def test_a_workbench_that_ends_well_leaves_the_guardian_at_it(log: Path) -> None:
    """Nothing but the guardian can put them off once the board is back: it is not killed for being slow."""
    lasers = bank()
    with pytest.raises(LaserOffNotConfirmedError), lasers.lit(["L2"], for_s=30):
        fail(log, "unplugged")
    guardian = lasers._guardian._process
    with pytest.raises(LaserOffNotConfirmedError, match=r"beams as on.* tries again for 60 s"):
        lasers.close()
    assert guardian.poll() is None
    assert masks(log)[-1] == 0b10
    fail(log, "")
    wait_for_dark(log)
    guardian.wait(10)
    assert guardian.returncode == 0


def test_lines_that_are_high_when_the_board_is_opened_are_tried_again(log: Path) -> None:
    """Somebody left them high, and the board does not take it: that is told, and not left at that."""
    fail(log, "stuck")
    with pytest.raises(LaserOffNotConfirmedError, match=r"lines read 1111 .*tries again"):
        bank()
    assert masks(log) == []
    repair(log)


def test_a_stop_does_not_take_the_place_of_what_the_board_tells(log: Path, tmp_path: Path) -> None:
    """And a reader of the command's output is not kept by the guardian, which goes on."""
    fail(log, "stuck")
    command = [str(SCRIPT), "lasers", "off", "--rig", str(rig_file(tmp_path, LINES))]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    wait_for(Path(f"{log}.tried").exists)
    time.sleep(0.5)  # it has been told by now, and waits for the guardian
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    said, _ = process.communicate(timeout=60)
    assert time.monotonic() - began < TRY_BOARD_S / 2
    assert process.returncode == 7, said
    assert re.search(r"error: .*lines read 1111 .*tries again", " ".join(said.split()))
    repair(log)


def repair(log: Path) -> None:
    """Let the guardian come to its end."""
    fail(log, "")
    wait_for(lambda: masks(log)[-1:] == [0])


def wait_for(it: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10
    while not it():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def lit_elsewhere(beat: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", LIGHT_AND_WAIT.replace("{beat}", beat)], stdout=subprocess.PIPE, text=True
    )
    hurry(process.pid, before=1)  # not before the guardian: it computes
    assert process.stdout is not None
    assert process.stdout.readline() == "lit\n"
    return process


def wait_for_dark(log: Path) -> int:
    deadline = time.monotonic() + 10
    while masks(log)[-1] != 0:
        assert time.monotonic() < deadline
        time.sleep(0.005)
    lit = [n for n, mask in enumerate(masks(log)) if mask]
    return changes(log)[lit[-1] + 1][0]


def test_lines_that_stay_high_are_never_taken_for_off(log: Path) -> None:
    lasers = bank()
    message = r"lines read 100 .*treat the beams as on"
    with pytest.raises(LaserOffNotConfirmedError, match=message), lasers.lit(["L3"], for_s=2.0):
        fail(log, "stuck")
    fail(log, "")
    lasers.close()


def test_a_board_unplugged_while_lit(log: Path) -> None:
    lasers = bank()
    with (
        pytest.raises(LaserOffNotConfirmedError, match="Device is not available"),
        lasers.lit(["L1"], for_s=2.0),
    ):
        fail(log, "unplugged")
    fail(log, "")
    lasers.close()
    assert masks(log)[-1] == 0


@pytest.mark.parametrize(
    ("lines", "how", "message"),
    [
        ("Dev9/port0", "", "Physical channel specified does not exist.*names of its lines"),
        (LINES, "no driver", "Could not find an installation of NI-DAQmx.*check that NI-DAQmx is installed"),
    ],
)
def test_a_board_that_is_not_there(log: Path, lines: str, how: str, message: str) -> None:
    fail(log, how)
    with pytest.raises(RigNotReadyError, match=message):
        bank(lines)


def test_fewer_lines_than_lasers(log: Path, tmp_path: Path) -> None:
    """Before anything is lit, and by every command that opens the rig's devices."""
    with pytest.raises(BadInputError, match="each of the rig's 4 lasers, got 2; name 4 lines"):
        bank("Dev1/port0/line0:1")
    done = call("doctor", rig_file(tmp_path, "Dev1/port0/line0:1"))
    assert done.returncode == 2
    assert "each of the rig's 4 lasers, got 2" in done.stderr
    assert "Traceback" not in done.stderr
    assert set(masks(log)) == {0}


@pytest.mark.skipif(importlib.util.find_spec("nidaqmx") is not None, reason="the package is installed")
def test_without_the_package(tmp_path: Path) -> None:
    path = rig_file(tmp_path, LINES)
    with pytest.raises(RigNotReadyError, match=r"expected the package nidaqmx.*pip install"):
        open_lasers(load_rig(path))
    done = call("doctor", path)
    assert done.returncode == 4
    assert "pip install" in done.stderr
    assert "Traceback" not in done.stderr


def test_what_is_called_is_in_the_real_package() -> None:
    """Where it is installed; without NI's driver, that is told."""
    package = pytest.importorskip("nidaqmx")
    errors = importlib.import_module("nidaqmx.errors")
    constants = importlib.import_module("nidaqmx.constants")
    assert "auto_start" in inspect.signature(package.Task.write).parameters
    assert callable(package.Task.read)
    for name in ("number_of_channels", "devices", "do_channels"):
        assert isinstance(inspect.getattr_static(package.Task, name), property)
    collections = importlib.import_module("nidaqmx.task.collections")
    assert "line_grouping" in inspect.signature(collections.DOChannelCollection.add_do_chan).parameters
    assert constants.LineGrouping.CHAN_PER_LINE
    assert issubclass(errors.DaqNotFoundError, errors.Error)
    assert issubclass(errors.DaqError, errors.Error)
    assert package.errors is errors


def test_the_rig_file_takes_it(tmp_path: Path) -> None:
    rig = load_bench_rig(rig_file(tmp_path, LINES))
    assert rig.devices is not None
    assert rig.devices.lasers.driver == "nidaqmx"
