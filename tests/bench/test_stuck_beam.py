"""A beam that burns by itself while the controller says that it is off."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.short import begin, write_files
from workbench.emulator.controller import Controller
from workbench.model.errors import LaserOffNotConfirmedError
from workbench.model.event import CaptureTaken, PlacementFinished
from workbench.session.journal import read_journal


def test_a_group_ends_with_a_look_for_beams(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """L1 is well while it is captured, and shorts when L4 is lit: L4's pairs do not show it, in both."""
    lit = Controller.lit
    shorted = False

    def lit_with_a_short(self: Controller) -> tuple[str, ...]:
        nonlocal shorted
        shorted = shorted or "L4" in lit(self)
        return tuple(sorted({*lit(self), *(["L1"] if shorted else [])}))

    monkeypatch.setattr(Controller, "lit", lit_with_a_short)
    write_files(tmp_path)
    with pytest.raises(LaserOffNotConfirmedError, match=r"300mm.* shows a spot.* cut the lasers"):
        begin(tmp_path, tmp_path / "session")
    events = [record.event for record in read_journal(tmp_path / "session")]
    assert [e.laser_id for e in events if isinstance(e, CaptureTaken)] == ["L1", "L4"]
    assert not any(isinstance(e, PlacementFinished) for e in events)
