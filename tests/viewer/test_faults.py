"""A calibration with four faults: all of them on the screen that opens, each with its captures."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.viewer.faults import MOVED, REFLECTED, SATURATED, TURNED, capture_numbers, write_session
from tests.viewer.harness import distinct_colors, headless_viewer
from tests.viewer.readback import Contents
from workbench.viewer.entities import FIT_VERDICT

pytestmark = pytest.mark.thorough


def test_the_first_screen_names_every_fault_and_its_captures(tmp_path: Path) -> None:
    session = write_session(tmp_path)
    numbers = capture_numbers(session)
    (verdict,) = Contents(session / "recording.rrd").static(f"/{FIT_VERDICT}", "TextDocument:text")[-1]
    lines = [line for line in verdict.splitlines() if line[:1] in {"*", "-"}]
    (moved,) = (line for line in lines if f"{MOVED} mm" in line)
    assert "609" in moved
    (turned,) = (line for line in lines if f"{TURNED} mm" in line)
    assert "turned by +6" in turned
    (bright,) = (line for line in lines if f"{SATURATED} mm" in line)
    assert f"captures {numbers['saturated']}-{numbers['saturated'] + 2}" in bright
    (two,) = (line for line in lines if f"{REFLECTED} mm" in line)
    assert f"captures {numbers['reflection']}-{numbers['reflection'] + 2}" in two
    with headless_viewer(tmp_path, "1600x900") as viewer:
        viewer.open(session / "recording.rrd")
        for number in numbers.values():
            viewer.go_to("capture", number)
            assert distinct_colors(viewer.shot()) > 200
        assert viewer.problems() == []
