"""The exposure that a session sets on the virtual bench: bright, whole, the same when resumed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from tests.bench.sensors import calibration_of
from tests.crash.short import CALLER, PROCEDURE, go_on, results, story, write_files
from workbench.cli.live import LiveRequest, _read_all
from workbench.cli.stopping import StopAfterCapture
from workbench.devices.registry import open_bench
from workbench.model import event as ev
from workbench.model.captures import load_captures
from workbench.model.errors import StoppedError
from workbench.model.rig import load_rig
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.ranging.ranger import Ranger
from workbench.session.capture_table import write_capture_table
from workbench.session.journal import read_journal

CAPTURES = PROCEDURE[: PROCEDURE.index("  - step: fit")].replace("[300, 600, 1500]", "[140, 600, 2500]")


def session(folder: Path, emulator: str = "", stop_after: int | None = None) -> Path:
    """Run three placements; stop when so many exposures are set."""
    folder.mkdir()
    rig, procedure = write_files(folder, CAPTURES)
    rig.write_text(rig.read_text() + emulator)
    seen: list[ev.Record] = []

    def stopping() -> str | None:
        told = sum(isinstance(record.event, ev.ExposureSet) for record in seen)
        return "enough" if told == stop_after else None

    run(Plan.load(rig, [procedure]), folder / "s", [seen.append], CALLER, stopping)
    return folder / "s"


def told(session: Path) -> list[ev.ExposureSet]:
    return [r.event for r in read_journal(session) if isinstance(r.event, ev.ExposureSet)]


def found(session: Path) -> list[ev.SpotsFound]:
    return [r.event for r in read_journal(session) if isinstance(r.event, ev.SpotsFound)]


def test_spots_are_bright_and_whole_at_every_standoff(tmp_path: Path) -> None:
    """At 2.5 m light is thinner by more than a hundred times than at 140 mm."""
    done = session(tmp_path / "a")
    settings = told(done)
    assert [e.verdict for e in settings] == ["good"] * 3
    assert all(0.55 <= e.peak <= 0.7 for e in settings)
    assert settings[2].exposure > 10 * settings[0].exposure
    spots = [spot for event in found(done) for spot in event.spots]
    assert len(spots) == 6
    assert not [spot for spot in spots if "saturated" in spot.flags]
    for placement in range(3):
        brightest = max(spot.peak_dn for spot in spots[2 * placement : 2 * placement + 2])
        assert 0.4 * 255 < brightest < 0.75 * 255
    taken = [r.event for r in read_journal(done) if isinstance(r.event, ev.CaptureTaken)]
    assert [e.exposure for e in taken] == [e.exposure for e in settings for _ in range(2)]
    rows = (done / "frames").rglob("*.png")
    assert len(list(rows)) == 12, "trial frames are not kept"


@pytest.mark.parametrize("stop_after", [1, *(pytest.param(n, marks=pytest.mark.thorough) for n in (2, 3))])
def test_a_stop_right_after_it_was_set(tmp_path: Path, stop_after: int) -> None:
    whole = session(tmp_path / "whole")
    with pytest.raises(StoppedError, match="enough"):
        session(tmp_path / "cut", stop_after=stop_after)
    go_on(tmp_path / "cut/s")
    assert story(tmp_path / "cut/s") == story(whole)
    assert results(tmp_path / "cut/s") == results(whole)


def test_the_captures_table_tells_exposure_and_unit(tmp_path: Path) -> None:
    done = session(tmp_path / "a")
    captures = [r.event for r in read_journal(done) if isinstance(r.event, ev.CaptureTaken)]
    write_capture_table(tmp_path / "captures.csv", captures)
    rows = load_captures(tmp_path / "captures.csv")
    assert [(row.exposure, row.exposure_unit) for row in rows] == [
        (e.exposure, "us") for e in told(done) for _ in range(2)
    ]


@pytest.mark.parametrize("virtual", [True, False])
def test_live_ranging_says_that_it_sets_no_exposure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], virtual: bool
) -> None:
    """The virtual bench meters by itself; a real camera does not."""
    rig = load_rig(write_files(tmp_path)[0])
    request = LiveRequest(tmp_path, tmp_path, readings=0, standoff_mm=500.0, stats=False)
    with open_bench(rig, tmp_path / "s") as bench:
        _read_all(
            replace(bench, virtual=virtual),
            Ranger(calibration_of(rig)),
            request,
            False,
            cast(StopAfterCapture, SimpleNamespace(reason=None)),
            None,
        )
    assert ("exposure of the rig file" in " ".join(capsys.readouterr().err.split())) != virtual


def test_a_fixed_exposure_is_left_alone(tmp_path: Path) -> None:
    done = session(tmp_path / "a", "  camera: {exposure_s: 1.0e-4}\n")
    assert told(done) == []
    taken = [r.event for r in read_journal(done) if isinstance(r.event, ev.CaptureTaken)]
    assert {e.exposure for e in taken} == {None}
    assert [e.key for e in found(done) for spot in e.spots if "saturated" in spot.flags], (
        "as it was asked for"
    )


@pytest.mark.parametrize(
    ("limits", "verdict"),
    [("shortest_exposure_s: 2.0e-3", "clipped"), ("longest_exposure_s: 4.0e-6", "dim")],
)
def test_limits_are_kept_and_what_they_cost_is_told(tmp_path: Path, limits: str, verdict: str) -> None:
    done = session(tmp_path / "a", f"  camera: {{{limits}}}\n")
    near = told(done)[0]
    assert near.verdict == verdict
    assert near.exposure == pytest.approx(2000 if verdict == "clipped" else 4)
