"""Data frames of a session's events; their columns are tested with the public interface."""

from __future__ import annotations

from tests.support.reference_session import REFERENCE, record
from workbench.report.session_frames import captures_frame, readings_frame, residuals_frame, spots_frame


def test_frames_have_one_row_for_each_event_in_effect() -> None:
    events = [one.event for one in record().records]
    captures = captures_frame(REFERENCE, events)
    assert len(captures) == captures["capture"].nunique() == 30
    assert all((REFERENCE / "frames").resolve().as_posix() in path for path in captures["on"])
    assert set(spots_frame(events)["capture"]) <= set(captures["capture"])
    assert len(readings_frame(events)) == 6
    assert sorted(set(residuals_frame(events)["standoff_mm"])) == [150, 200, 280, 400, 600, 900]


def test_no_events_give_empty_frames_with_columns() -> None:
    for frame in (captures_frame(REFERENCE, []), spots_frame([]), residuals_frame([]), readings_frame([])):
        assert len(frame) == 0
        assert len(frame.columns) > 5
