"""The exposure that a session sets on the virtual bench: bright, whole, the same when resumed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.short import CALLER, PROCEDURE, go_on, results, story, write_files
from workbench.model import event as ev
from workbench.model.errors import StoppedError
from workbench.procedure.run import Plan, run
from workbench.session.journal import read_journal

CAPTURES = PROCEDURE[: PROCEDURE.index("  - step: fit")].replace("[300, 600, 1500]", "[130, 600, 2500]")


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
    """At 2.5 m light is thinner by more than a hundred times than at 130 mm."""
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


@pytest.mark.parametrize("stop_after", [1, 2, 3])
def test_a_stop_right_after_it_was_set(tmp_path: Path, stop_after: int) -> None:
    whole = session(tmp_path / "whole")
    with pytest.raises(StoppedError, match="enough"):
        session(tmp_path / "cut", stop_after=stop_after)
    go_on(tmp_path / "cut/s")
    assert story(tmp_path / "cut/s") == story(whole)
    assert results(tmp_path / "cut/s") == results(whole)


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
