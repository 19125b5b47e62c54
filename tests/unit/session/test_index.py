"""Index of sessions: as the sessions themselves, and only changed ones are read again."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import pytest

from tests.support.reference_session import copied
from workbench.model.errors import BadInputError
from workbench.session import index
from workbench.session.index import INDEX, IndexedSession, indexed_sessions
from workbench.session.journal import JOURNAL, Journal
from workbench.session.state import session_statuses

OLD = Path(__file__).parents[3] / "data/session-0.1.0"


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
