"""Dates of sessions: remarks on those that cannot be right, which do not order calibrations."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime

from workbench.model.dates import CHECK_CLOCK, CLOCK_TOLERANCE, is_future, parsed_time
from workbench.model.number_text import counted
from workbench.session.index import IndexedSession
from workbench.session.manifest import MANIFEST

EARLIEST = datetime.min.replace(tzinfo=UTC)
REMEDY = "restore session.yaml from a copy"


def wrong_date(one: IndexedSession) -> str:
    """Remark on a start time that is no time, or later than the first record; empty if it is right."""
    began = parsed_time(one.began)
    where = one.status.session_dir / MANIFEST
    if began is None:
        return f"{where}: expected the time of the start in ISO 8601, got {one.began!r}; {REMEDY}"
    first = datetime.fromtimestamp(one.first_record_ns / 1e9, tz=UTC)
    if one.first_record_ns and began - first > CLOCK_TOLERANCE:
        return f"{where}: the start, {one.began}, is after the first record, {first:%Y-%m-%d %H:%M}; {REMEDY}"
    return ""


def start_of(one: IndexedSession) -> datetime:
    """Start of a session; the earliest time there is if it is no time."""
    return parsed_time(one.began) or EARLIEST


def future_text(sessions: Iterable[IndexedSession]) -> str:
    """Remark on sessions that begin after now; empty without one."""
    names = [f"{one.name} ({one.began[:10]})" for one in sessions if is_future(start_of(one))]
    if not names:
        return ""
    return f"{counted(len(names), 'session')} in the future, last {names[-1]}: {CHECK_CLOCK}"
