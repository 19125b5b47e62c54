"""A beam that burns by itself while the controller says that it is off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.crash.short import PROCEDURE, begin, write_files
from workbench.devices.protocols import Frame
from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.controller import Controller
from workbench.model.errors import LaserOffNotConfirmedError
from workbench.model.event import CaptureTaken, PlacementFinished
from workbench.session.journal import read_journal


def test_a_group_ends_with_a_look_for_beams(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """L1 is well while captured, and shorts when L4 is lit alone: L4's pairs show it in both frames."""
    lit = Controller.lit
    shorted = False

    def lit_with_a_short(self: Controller) -> tuple[str, ...]:
        nonlocal shorted
        shorted = shorted or lit(self) == ("L4",)
        return tuple(sorted({*lit(self), *(["L1"] if shorted else [])}))

    monkeypatch.setattr(Controller, "lit", lit_with_a_short)
    write_files(tmp_path)
    with pytest.raises(LaserOffNotConfirmedError, match=r"300mm.* shows a spot.* cut the lasers"):
        begin(tmp_path, tmp_path / "session")
    events = [record.event for record in read_journal(tmp_path / "session")]
    assert [e.laser_id for e in events if isinstance(e, CaptureTaken)] == ["L1", "L4"]
    assert not any(isinstance(e, PlacementFinished) for e in events)


@pytest.mark.parametrize("standoff_mm", [125, 300, 1500])
def test_beams_that_burn_from_the_first_shot_on(tmp_path: Path, standoff_mm: float) -> None:
    """Lit and dark frames are alike: no exposure is bright enough, and a long one must not hide them."""
    write_files(tmp_path, PROCEDURE.replace("[300, 600, 1500]", f"[{standoff_mm}]"))
    rig = tmp_path / "rig.yaml"
    rig.write_text(rig.read_text() + "  controller: {fault: hides_stuck_beam}\n")
    with pytest.raises(LaserOffNotConfirmedError, match="shows a spot"):
        begin(tmp_path, tmp_path / "session")


@pytest.mark.parametrize("lasts", [False, True])
def test_a_faint_light_counts_if_it_is_there_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lasts: bool
) -> None:
    """Noise makes one once in some hundred frames; a beam may be that faint, and stays."""
    grab = EmulatedCamera.grab
    v, u = np.mgrid[:480, :640]
    light = 6.0 * np.exp(-((u - 200) ** 2 + (v - 300) ** 2) / (2 * 1.3**2))
    looked = []

    def grab_with_light(self: EmulatedCamera) -> Frame:
        frame = grab(self)
        if not self._key.endswith("300mm/L4/00") or self._number < 2:  # the dark frame is the second
            return frame
        looked.append(self._number)
        if self._number > 2 and not lasts:
            return frame
        return replace(frame, image=np.clip(np.rint(frame.image + light), 0, 255).astype(np.uint8))

    monkeypatch.setattr(EmulatedCamera, "grab", grab_with_light)
    write_files(tmp_path)
    if lasts:
        with pytest.raises(LaserOffNotConfirmedError, match=r"300mm.* shows a spot at u = 200, v = 300 px"):
            begin(tmp_path, tmp_path / "session")
    else:
        begin(tmp_path, tmp_path / "session")
    assert looked == [2, 3]
