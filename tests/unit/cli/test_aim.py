"""`workbench aim`: lasers in turn until Ctrl-C."""

from __future__ import annotations

import io
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.cli.aim import TypedNumbers
from workbench.devices.protocols import Frame
from workbench.emulator.camera import EmulatedCamera
from workbench.session.manifest import load_manifest

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"
CALIBRATION = SESSION / "calibration.yaml"


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """The rig of a recorded session."""
    path = tmp_path / "rig.yaml"
    path.write_text(load_manifest(SESSION).rig.text)
    return path


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Standoffs that are typed after each round; then the signal comes."""

    def enter(*standoffs: float | None, end: signal.Signals = signal.SIGINT) -> None:
        entered = iter(standoffs)

        def latest(_: TypedNumbers) -> float | None:
            standoff = next(entered, "end")
            if isinstance(standoff, str):
                os.kill(os.getpid(), end)
                return None
            return standoff

        monkeypatch.setattr(TypedNumbers, "latest", latest)

    return enter


def test_lasers_are_read_in_turn_until_ctrl_c(workbench: Run, rig: Path, typed: Callable[..., None]) -> None:
    typed(1500.0)
    outcome = workbench("aim", "--rig", rig, "--calibration", CALIBRATION, "--standoff", 500)
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert [line.partition(":")[0] for line in lines] == 2 * ["L1", "L4"]
    assert all("off by" in line for line in lines)
    assert ["mrad" in line for line in lines] == 2 * [False] + 2 * [True]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_another_signal_is_a_stop(
    workbench: Run, rig: Path, typed: Callable[..., None], number: signal.Signals
) -> None:
    typed(end=number)
    outcome = workbench("aim", "--rig", rig, "--calibration", CALIBRATION)
    refused(outcome, 5, number.name)


def test_a_camera_that_fails_ends_it(
    workbench: Run, rig: Path, typed: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(camera: EmulatedCamera) -> Frame:
        raise OSError("unplugged")

    typed()
    monkeypatch.setattr(EmulatedCamera, "grab", fail)
    assert workbench("aim", "--rig", rig, "--calibration", CALIBRATION).code != 0


def test_a_calibration_of_another_sensor_is_refused(workbench: Run, rig: Path) -> None:
    rig.write_text(rig.read_text().replace("id: L4", "id: L9"))
    refused(workbench("aim", "--rig", rig, "--calibration", CALIBRATION), 2, "L9")


def typed_on(monkeypatch: pytest.MonkeyPatch, text: str) -> TypedNumbers:
    """Numbers of a standard input with this text, which is always readable."""
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    monkeypatch.setattr("select.select", lambda read, *_: (read, [], []))
    return TypedNumbers()


@pytest.mark.parametrize(
    ("text", "standoff_mm"),
    [
        ("", None),
        ("\n", None),
        ("500\n", 500.0),
        ("500\n 1200,5 mm\n", 1200.5),
        ("-3\n", None),
        ("far\n", None),
    ],
)
def test_the_last_standoff_that_was_typed_counts(
    monkeypatch: pytest.MonkeyPatch, text: str, standoff_mm: float | None
) -> None:
    typed = typed_on(monkeypatch, text)
    assert typed.latest() == standoff_mm
    assert typed.latest() is None
