"""Dates of sessions that cannot be right."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from tests.support.reference_session import copied
from workbench.report.history.dates import future_text, wrong_date
from workbench.session.index import indexed_sessions


@pytest.mark.parametrize(("hours", "right"), [(-72, True), (20, True), (28, False)])
def test_a_start_after_the_first_record_is_wrong(tmp_path: Path, hours: float, right: bool) -> None:
    copied(tmp_path)
    (session,) = indexed_sessions(tmp_path)
    assert wrong_date(session) == ""
    began = datetime.fromisoformat(session.began) + timedelta(hours=hours)
    assert (wrong_date(replace(session, began=began.isoformat())) == "") == right


def test_a_session_in_the_future_is_named(tmp_path: Path) -> None:
    copied(tmp_path)
    (session,) = indexed_sessions(tmp_path)
    past, future = (replace(session, began=f"{year}-01-01T00:00:00+0000") for year in (2001, 2999))
    assert future_text([past]) == ""
    assert session.name in future_text([past, future])
