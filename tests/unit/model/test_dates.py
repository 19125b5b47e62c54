"""Times of records."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from workbench.model.dates import future_remark, is_future, parsed_time


@pytest.mark.parametrize("text", ["", "0", "zzzz", "2026-13-01T00:00:00+0000"])
def test_a_text_that_is_no_time_has_none(text: str) -> None:
    assert parsed_time(text) is None
    assert future_remark("x", text) == ""


def test_times_of_other_zones_are_compared_in_utc() -> None:
    assert parsed_time("2026-11-30T08:50:45+0200") == datetime(2026, 11, 30, 6, 50, 45, tzinfo=UTC)
    assert parsed_time("2026-11-30T08:50:45") == datetime(2026, 11, 30, 8, 50, 45, tzinfo=UTC)


def test_the_future_begins_a_day_from_now() -> None:
    now = datetime.now(UTC)
    times = [now + timedelta(hours=hours) for hours in (-1, 23, 25)]
    assert [is_future(time) for time in times] == [False, False, True]
    assert [bool(future_remark("x", time.isoformat())) for time in times] == [False, False, True]
