"""Dates of sessions that cannot be right."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tests.support.reference_session import copied
from workbench.report.history.dates import future_text, is_future, parsed_time, wrong_date
from workbench.session.index import indexed_sessions


@pytest.mark.parametrize("text", ["", "0", "zzzz", "2026-13-01T00:00:00+0000"])
def test_a_text_that_is_no_time_has_none(text: str) -> None:
    assert parsed_time(text) is None


def test_times_of_other_zones_are_compared_in_utc() -> None:
    assert parsed_time("2026-11-30T08:50:45+0200") == datetime(2026, 11, 30, 6, 50, 45, tzinfo=UTC)
    assert parsed_time("2026-11-30T08:50:45") == datetime(2026, 11, 30, 8, 50, 45, tzinfo=UTC)


@pytest.mark.parametrize(("hours", "right"), [(-72, True), (20, True), (28, False)])
def test_a_start_after_the_first_record_is_wrong(tmp_path: Path, hours: float, right: bool) -> None:
    copied(tmp_path)
    (session,) = indexed_sessions(tmp_path)
    assert wrong_date(session) == ""
    began = datetime.fromisoformat(session.began) + timedelta(hours=hours)
    assert (wrong_date(replace(session, began=began.isoformat())) == "") == right


def test_the_future_begins_a_day_from_now(tmp_path: Path) -> None:
    now = datetime.now(UTC)
    assert [is_future(now + timedelta(hours=hours)) for hours in (-1, 23, 25)] == [False, False, True]
    copied(tmp_path)
    (session,) = indexed_sessions(tmp_path)
    past, future = (replace(session, began=f"{year}-01-01T00:00:00+0000") for year in (2001, 2999))
    assert future_text([past]) == ""
    assert session.name in future_text([past, future])
