"""Index of sessions: as the sessions themselves, and only changed ones are read again."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from tests.support.reference_session import copied
from workbench.model.errors import BadInputError
from workbench.session import index
from workbench.session.index import INDEX, IndexedSession, indexed_sessions
from workbench.session.journal import JOURNAL, Journal
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


def test_a_damaged_session_is_listed(folder: Path) -> None:
    (folder / "a" / JOURNAL).write_text("damaged\n")
    (folder / "b/session.yaml").write_text("damaged: [\n")
    found = indexed_sessions(folder)
    assert (found[0].status.state, found[0].verdict) == ("damaged", "none")
    assert (found[1].serial, found[1].began) == ("", "")


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="folder of sessions"):
        indexed_sessions(tmp_path / "missing")
