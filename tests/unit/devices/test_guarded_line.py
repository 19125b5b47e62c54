"""A laser driver of another package behind the real guardian: off in time, whatever the driver does wrong."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar

import pytest

from tests.firmware.parts import hurried, hurry
from tests.support.driver_package import ROOT
from tests.support.foreign_drivers import install_drivers, write_rig
from workbench.devices.controller_line import ControllerLine
from workbench.devices.digital_output import DigitalOutputLine
from workbench.devices.guarded_line import CheckedLine, driver_errors, line_reference
from workbench.devices.protocols import LaserBank, LaserState
from workbench.devices.registry import open_lasers
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.rig import load_rig

END_MS = 50
"""From the end of the workbench to lasers off, as docs/laser-controller.md promises."""
HANG_MS = 600
REPEATS = 3
AT_WORK = """
import sys, time
from pathlib import Path
from workbench.devices.registry import open_lasers
from workbench.model.rig import load_rig
bank = open_lasers(load_rig(Path(sys.argv[1])))
with bank.lit(["L2"], for_s=30):
    print("lit", flush=True)
    while True:
        time.sleep(0.05)
        bank.beat()
"""


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    install_drivers(tmp_path / "lib", monkeypatch)
    lasers = f"lasers: {{driver: lab_lasers, log: {tmp_path / 'lines.log'}}}"
    return write_rig(tmp_path / "rig.yaml", [lasers])


@pytest.fixture
def bank(rig: Path) -> Iterator[LaserBank]:
    bank = open_lasers(load_rig(rig))
    yield bank
    fail(rig, "")
    bank.close()


def fail(rig: Path, what: str) -> None:
    rig.with_name("lines.log.fault").write_text(what)


def changes(rig: Path) -> list[tuple[int, int]]:
    """(monotonic time in ns, mask) of each time that the line was written."""
    whole = rig.with_name("lines.log").read_text().rpartition("\n")[0].splitlines()
    return [(int(time_ns), int(mask)) for time_ns, mask in map(str.split, whole)]


def mask(rig: Path) -> int:
    return changes(rig)[-1][1]


@contextmanager
def at_work(rig: Path) -> Iterator[subprocess.Popen[str]]:
    """A workbench that holds L2 on and beats."""
    command = [sys.executable, "-c", AT_WORK, str(rig)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    hurry(process.pid, before=1)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "lit\n"
        yield process
    finally:
        process.kill()
        process.communicate(timeout=20)


def off_after_ms(rig: Path, how: signal.Signals) -> float:
    with at_work(rig) as process:
        assert mask(rig) == 0b10
        with hurried():
            began_ns = time.monotonic_ns()
            process.send_signal(how)
        deadline = time.monotonic() + 10
        while mask(rig):
            assert time.monotonic() < deadline
            time.sleep(0.005)
        last_on = max(n for n, (_, lit) in enumerate(changes(rig)) if lit)
        return (changes(rig)[last_on + 1][0] - began_ns) / 1e6


@pytest.mark.parametrize(
    ("how", "limit_ms"),
    [
        (signal.SIGKILL, END_MS),
        (signal.SIGTERM, END_MS),
        (signal.SIGSEGV, END_MS),
        (signal.SIGSTOP, HANG_MS),
    ],
)
def test_lasers_go_off_in_time_when_the_workbench_ends(
    rig: Path, how: signal.Signals, limit_ms: float
) -> None:
    delays = [off_after_ms(rig, how) for _ in range(REPEATS)]
    print(f"{how.name}: off after", ", ".join(f"{delay:.1f}" for delay in delays), "ms")
    assert min(delays) > 0
    assert max(delays) <= limit_ms


def test_what_a_driver_prints_is_not_taken_for_an_answer(rig: Path, bank: LaserBank) -> None:
    assert bank.identity == "lab lasers"
    with bank.lit(["L1"], for_s=2.0):
        assert bank.state() == LaserState(("L1",), True)
        assert mask(rig) == 0b01
    assert mask(rig) == 0


@pytest.mark.parametrize(
    ("what", "error"),
    [("light", RigNotReadyError), ("state", RigNotReadyError), ("off", LaserOffNotConfirmedError)],
)
@pytest.mark.parametrize(("how", "kind"), [("", "ZeroDivisionError"), ("exit-", "SystemExit")])
def test_a_defect_of_the_driver_is_an_answer_and_the_guardian_goes_on(
    rig: Path, bank: LaserBank, what: str, error: type[Exception], how: str, kind: str
) -> None:
    calls = {"light": lambda: None, "state": bank.state, "off": bank.all_off}
    fail(rig, how + what)
    with pytest.raises(error, match=kind), bank.lit(["L1"], for_s=2.0):
        calls[what]()
    fail(rig, "")
    bank.all_off()
    assert mask(rig) == 0
    with bank.lit(["L2"], for_s=2.0):
        assert mask(rig) == 0b10


def wait_for_dark(rig: Path) -> None:
    deadline = time.monotonic() + 10
    while mask(rig):
        assert time.monotonic() < deadline
        time.sleep(0.005)


@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
@pytest.mark.parametrize("what", ["off", "exit-off"])
def test_an_off_that_fails_while_the_workbench_hangs_or_is_gone_is_tried_until_it_works(
    rig: Path, how: signal.Signals, what: str
) -> None:
    with at_work(rig) as process:
        fail(rig, what)
        process.send_signal(how)
        time.sleep(1.0)
        assert mask(rig) == 0b10
        fail(rig, "")
        wait_for_dark(rig)


def test_a_driver_that_exits_in_off_has_not_confirmed_it(rig: Path) -> None:
    lasers = open_lasers(load_rig(rig))
    with pytest.raises(LaserOffNotConfirmedError), lasers.lit(["L2"], for_s=2.0):
        fail(rig, "exit-off")
    with pytest.raises(LaserOffNotConfirmedError):
        lasers.close()
    assert mask(rig) == 0b10
    fail(rig, "")
    wait_for_dark(rig)


def test_a_state_in_numpys_types_is_the_same_state(rig: Path, bank: LaserBank) -> None:
    fail(rig, "numpy")
    with bank.lit(["L2"], for_s=2.0):
        assert bank.state() == LaserState(("L2",), True)


@pytest.mark.parametrize(
    ("what", "error", "left_on"),
    [
        ("open", RigNotReadyError, None),
        ("identify", RigNotReadyError, 0),
        ("exit-identify", RigNotReadyError, 0),
        ("off", LaserOffNotConfirmedError, 0b11),
        ("identify off", LaserOffNotConfirmedError, 0b11),
        ("exit-identify exit-off", LaserOffNotConfirmedError, 0b11),
    ],
)
def test_a_driver_that_fails_at_connect(
    rig: Path, what: str, error: type[Exception], left_on: int | None
) -> None:
    """The line is on when it is opened."""
    fail(rig, what)
    with pytest.raises(error, match="SystemExit" if "exit" in what else "ZeroDivisionError"):
        open_lasers(load_rig(rig))
    if left_on is None:
        return
    assert mask(rig) == left_on
    fail(rig, "")
    wait_for_dark(rig)


def test_only_errors_of_the_promised_kind_pass() -> None:
    with pytest.raises(BadInputError), driver_errors():
        raise BadInputError("too few lines")
    with pytest.raises(RigNotReadyError), driver_errors(only=RigNotReadyError):
        raise LaserOffNotConfirmedError("not a reason to leave the lease alone")
    with (
        pytest.raises(LaserOffNotConfirmedError),
        driver_errors(only=LaserOffNotConfirmedError, raised=LaserOffNotConfirmedError),
    ):
        raise RigNotReadyError("no answer")


@pytest.mark.parametrize("defect", [SystemExit(0), KeyboardInterrupt(), ZeroDivisionError()])
def test_no_defect_of_a_driver_passes(defect: BaseException) -> None:
    with pytest.raises(RigNotReadyError, match=type(defect).__name__), driver_errors():
        raise defect


def test_an_error_whose_text_fails_is_reported_by_its_kind() -> None:
    class VendorError(Exception):
        def __str__(self) -> str:
            raise OSError("no text for this code")

    with pytest.raises(RigNotReadyError, match="VendorError"), driver_errors():
        raise VendorError


def test_a_line_that_reports_nonsense_is_not_believed() -> None:
    class Line:
        settings_type: ClassVar = None
        has_leases: ClassVar[bool] = True

        def __init__(self, settings: object, lasers: int, alarm: object) -> None: ...
        def identify(self, boot_s: float) -> str:
            return ""

        def light(self, mask: int, lease_ms: int) -> None: ...
        def all_off(self) -> None: ...
        def state(self) -> tuple[int, bool | None]:
            return "all", None  # type: ignore[return-value] # what a foreign driver may do

    with pytest.raises(RigNotReadyError):
        CheckedLine(Line(None, 1, None)).state()


@pytest.mark.parametrize("line_type", [ControllerLine, DigitalOutputLine])
def test_the_guardian_imports_no_numerics(line_type: type) -> None:
    """It starts in a fraction of a second, and holds little memory, which takes time to be given back."""
    look = (
        "import sys, importlib\nimport workbench.devices.guardian\n"
        f"importlib.import_module({line_reference(line_type).partition(':')[0]!r})\n"
        "print(*sorted({'numpy', 'jax', 'cv2', 'scipy', 'pandas'} & set(sys.modules)))"
    )
    said = subprocess.run(
        [sys.executable, "-P", "-c", look], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert said.stdout.split() == []
