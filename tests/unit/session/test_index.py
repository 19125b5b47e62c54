"""Index of sessions: as the sessions themselves, and only changed ones are read again."""

from __future__ import annotations

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from tests.support.reference_session import REFERENCE, copied, repeated
from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.session import index
from workbench.session.index import INDEX, IndexedSession, copies_text, indexed_sessions, read_indexed
from workbench.session.journal import JOURNAL, Journal, read_journal
from workbench.session.state import session_statuses

OLD = Path(__file__).parents[3] / "data/session-0.1.0"
PAGE = 4096
"""Size of a page of an SQLite file, bytes."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    copied(tmp_path, "b")
    shutil.copytree(OLD, tmp_path / "a", ignore=shutil.ignore_patterns("frames"))
    return tmp_path


def test_the_index_has_the_states_of_the_sessions(folder: Path) -> None:
    found = indexed_sessions(folder)
    assert [one.status for one in found] == session_statuses(folder)
    assert [(one.name, one.serial, one.verdict) for one in found] == [
        ("a", "emulated-1", "accepted"),
        ("b", "reference-1", "accepted"),
    ]
    assert found[1].calibration == "calibration.yaml"
    assert found[1].verified
    assert indexed_sessions(folder) == found


def test_only_changed_sessions_are_read_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = indexed_sessions(folder)
    read: list[str] = []
    original = index.read_indexed

    def counted(path: Path) -> IndexedSession:
        read.append(path.name)
        return original(path)

    monkeypatch.setattr(index, "read_indexed", counted)
    assert indexed_sessions(folder) == before
    assert read == []
    lines = (folder / "b" / JOURNAL).read_text().splitlines(keepends=True)
    (folder / "b" / JOURNAL).write_text("".join(lines[:-1]))
    shutil.rmtree(folder / "a")
    after = indexed_sessions(folder)
    assert read == ["b"]
    assert [(one.name, one.status.state) for one in after] == [("b", "interrupted")]


def test_a_running_session_is_seen_although_its_files_do_not_change(folder: Path) -> None:
    lines = (folder / "b" / JOURNAL).read_text().splitlines(keepends=True)
    (folder / "b" / JOURNAL).write_text("".join(lines[:-1]))
    assert indexed_sessions(folder)[1].status.state == "interrupted"
    journal, _ = Journal.reopen(folder / "b")
    assert indexed_sessions(folder)[1].status.state == "running"
    journal.close()
    assert indexed_sessions(folder)[1].status.state == "interrupted"


@pytest.mark.parametrize("content", [b"", b"no database at all, but long enough to look like one" * 10])
def test_a_damaged_index_is_made_again(folder: Path, content: bytes) -> None:
    before = indexed_sessions(folder)
    (folder / INDEX).write_bytes(content)
    assert indexed_sessions(folder) == before
    assert is_index(folder / INDEX)


def is_index(path: Path) -> bool:
    with closing(sqlite3.connect(path)) as database:
        rows = database.execute("SELECT name FROM sessions").fetchall()
    return len(rows) == 2


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("page", [0, 1, 2])
def test_an_index_with_a_damaged_page_is_made_again(folder: Path, page: int, seed: int) -> None:
    before = indexed_sessions(folder)
    damaged = bytearray((folder / INDEX).read_bytes())
    start = page * PAGE
    damaged[start : start + PAGE] = np.random.default_rng(seed).bytes(PAGE)
    (folder / INDEX).write_bytes(damaged)
    assert indexed_sessions(folder) == before
    assert indexed_sessions(folder) == before


@pytest.mark.parametrize("content", ["{}", "[]", "5", "", None, b"\xff", '{"status": 5}'])
def test_an_index_with_a_damaged_row_is_made_again(folder: Path, content: str | bytes | None) -> None:
    before = indexed_sessions(folder)
    with closing(sqlite3.connect(folder / INDEX)) as database, database:
        database.execute("UPDATE sessions SET content = ? WHERE name = 'b'", [content])
    assert indexed_sessions(folder) == before
    assert is_index(folder / INDEX)


def test_an_index_that_cannot_be_replaced_is_made_in_memory(folder: Path) -> None:
    before = indexed_sessions(folder)
    (folder / INDEX).unlink()
    (folder / INDEX).mkdir()
    assert indexed_sessions(folder) == before


def test_an_index_in_use_is_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = indexed_sessions(folder)
    monkeypatch.setattr(index, "BUSY_S", 0.01)
    with closing(sqlite3.connect(folder / INDEX, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        assert indexed_sessions(folder) == before
    assert is_index(folder / INDEX)


def test_an_index_of_another_format_is_made_again(folder: Path) -> None:
    before = indexed_sessions(folder)
    with sqlite3.connect(folder / INDEX) as database:
        database.execute("PRAGMA user_version = 99")
        database.execute("UPDATE sessions SET content = 'old'")
    database.close()
    assert indexed_sessions(folder) == before


def test_a_damaged_session_is_listed_with_its_error_beside_the_others(folder: Path) -> None:
    sound = repeated(folder, "c", days=1)
    (folder / "a" / JOURNAL).write_text("damaged\n")
    (folder / "b/session.yaml").write_text("damaged: [\n")
    for _ in range(2):
        found = indexed_sessions(folder)
        assert [one.status.state for one in found] == ["damaged", "damaged", "finished"]
        assert (found[0].serial, found[0].verdict) == ("emulated-1", "none")
        assert str(folder / "a" / JOURNAL) in found[0].status.why
        assert (found[1].serial, found[1].began) == ("", "")
        assert str(folder / "b/session.yaml") in found[1].status.why
        assert (found[2].name, found[2].verdict) == (sound.name, "accepted")


def test_a_name_that_is_no_unicode_does_not_hide_other_sessions(folder: Path) -> None:
    name = os.fsdecode(b"c\xff")
    repeated(folder, name, days=1)
    for _ in range(2):
        assert [one.name for one in indexed_sessions(folder)] == ["a", "b", name]


def test_copies_and_links_count_once(folder: Path) -> None:
    before = indexed_sessions(folder)
    assert copies_text(before) == ""
    copied(folder, "0")
    shutil.copytree(folder / "b", folder / "1")
    (folder / "2").symlink_to("b")
    for _ in range(2):
        found = indexed_sessions(folder)
        assert [one.name for one in found] == ["0", "a"]
        assert found[0].copies == ("1", "b", "2")
    assert len(copies_text(found).splitlines()) == 1


def test_the_copy_with_most_records_counts_then_the_one_with_its_first_name(folder: Path) -> None:
    copied(folder)  # by its own name
    assert [(one.name, one.copies) for one in indexed_sessions(folder)[:1]] == [(REFERENCE.name, ("b",))]
    journal, records = Journal.reopen(folder / "b")
    with journal:
        journal.append(records[-1].event)
    assert [one.name for one in indexed_sessions(folder)] == ["a", "b"]


def with_events(folder: Path, *events: ev.Event) -> IndexedSession:
    session = repeated(folder, "c", days=1)
    lines = (session / JOURNAL).read_text().splitlines(keepends=True)
    records = [ev.Record.model_validate_json(line) for line in lines]
    others = [
        one.event for one in records if not isinstance(one.event, ev.FitFinished | ev.CalibrationExported)
    ]
    times = records[0].time_ns
    kept = [
        ev.Record(n=n, time_ns=times, event=one) for n, one in enumerate((others[0], *events, *others[1:]))
    ]
    (session / JOURNAL).write_text("".join(f"{one.model_dump_json()}\n" for one in kept))
    return read_indexed(session)


def test_an_exception_is_an_export_after_the_refused_fit(folder: Path) -> None:
    events = [one.event for one in read_journal(folder / "b")]
    accepted = next(one for one in events if isinstance(one, ev.FitFinished))
    refused = accepted.model_copy(update={"verdict": "refused"})
    export = ev.CalibrationExported(path="calibration.yaml", sha256="0")
    verdicts = {
        (refused, export): "exception",
        (accepted, export, refused): "refused",
        (refused, export, accepted, export): "accepted",
        (refused,): "refused",
        (): "none",
    }
    for order, verdict in verdicts.items():
        assert with_events(folder, *order).verdict == verdict
        shutil.rmtree(folder / "c")


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="folder of sessions"):
        indexed_sessions(tmp_path / "missing")
