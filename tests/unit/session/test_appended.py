"""Files to which programs append lines."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.session import appended
from workbench.session.appended import append_line, locked, read_lines


def add(path: Path, line: str) -> None:
    with locked(path) as handle:
        append_line(handle, path, line)


def test_lines_are_read_as_they_were_appended(tmp_path: Path) -> None:
    """JSON may contain these characters, at which `str.splitlines` would split."""
    path, lines = tmp_path / "a.jsonl", ["one", "two\u2028\u2029\x85\x0b", "three"]
    for line in lines:
        add(path, line)
    assert read_lines(path, "a record") == lines


def test_a_last_line_without_its_end_is_ended_first(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text("one")
    add(path, "two")
    assert read_lines(path, "a record") == ["one", "two"]


def test_an_empty_file_has_no_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.touch()
    assert read_lines(path, "a record") == []


def test_a_file_that_another_program_holds_is_an_error_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(appended, "LOCK_S", 0.1)
    path = tmp_path / "a.jsonl"
    with path.open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(BadInputError, match=str(path)):
            add(path, "one")
    assert path.read_text() == ""


def test_no_regular_file_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    os.mkfifo(path)
    with pytest.raises(BadInputError, match=str(path)):
        add(path, "one")
