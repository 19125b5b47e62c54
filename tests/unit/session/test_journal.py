"""The journal: appended, read back, torn, damaged."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import Record, SessionFinished, SessionStarted, StepStarted
from workbench.session.journal import JOURNAL, Journal, is_running, last_chain, read_journal

STARTED = SessionStarted(session="s", rig="r", procedures=("p",))
STEP = StepStarted(procedure="p", index=1, step="fit", title="Fit", shots=0)


def test_what_is_journalled_is_read(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        written = [journal.append(event) for event in (STARTED, STEP)]
    assert list(read_journal(tmp_path)) == written
    assert [record.n for record in written] == [0, 1]


def test_a_torn_tail_is_dropped(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        first = journal.append(STARTED)
        journal.append(STEP)
    path = tmp_path / JOURNAL
    whole = path.read_bytes()
    for cut in range(len(whole.splitlines(keepends=True)[0]), len(whole)):
        path.write_bytes(whole[:cut])
        assert list(read_journal(tmp_path)) == [first]


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for event in (STARTED, STEP, SessionFinished(exit_code=0, message="done")):
            journal.append(event)
    path = tmp_path / JOURNAL
    path.write_bytes(path.read_bytes().replace(b'"index":1', b'"index":"x"'))
    with pytest.raises(BadInputError, match=r"journal\.jsonl:2: "):
        list(read_journal(tmp_path))


@pytest.mark.parametrize(("order", "line"), [((0, 2), 2), ((0, 1, 1, 2), 3), ((0, 2, 1), 2), ((1, 2), 1)])
def test_a_line_that_is_missing_repeated_or_exchanged_is_named(
    tmp_path: Path, order: tuple[int, ...], line: int
) -> None:
    with Journal(tmp_path) as journal:
        for event in (STARTED, STEP, SessionFinished(exit_code=0, message="done")):
            journal.append(event)
    path = tmp_path / JOURNAL
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[number] for number in order))
    with pytest.raises(BadInputError, match=rf"journal\.jsonl:{line}: "):
        list(read_journal(tmp_path))


@pytest.mark.parametrize("time_ns", [-1, 2**63])
def test_a_time_out_of_range_is_named(tmp_path: Path, time_ns: int) -> None:
    with Journal(tmp_path) as journal:
        written = journal.append(STARTED)
    path = tmp_path / JOURNAL
    path.write_text(path.read_text().replace(str(written.time_ns), str(time_ns)))
    with pytest.raises(BadInputError, match=r"journal\.jsonl:1: "):
        list(read_journal(tmp_path))


@pytest.mark.parametrize("line", [0, 1, 2])
def test_an_edited_number_is_refused_with_its_line(tmp_path: Path, line: int) -> None:
    with Journal(tmp_path) as journal:
        for event in (STEP, STEP, STEP):
            journal.append(event)
    path = tmp_path / JOURNAL
    lines = path.read_bytes().splitlines(keepends=True)
    lines[line] = lines[line].replace(b'"shots":0', b'"shots":1')
    path.write_bytes(b"".join(lines))
    for read in (read_journal, Journal.reopen):
        with pytest.raises(BadInputError, match=rf"journal\.jsonl:{line + 1}: ") as caught:
            list(read(tmp_path))
        assert caught.value.exit_code == 2


def test_a_reopened_journal_continues_the_hash_chain_also_of_an_older_version(tmp_path: Path) -> None:
    path = tmp_path / JOURNAL
    old = [Record(n=n, time_ns=n, event=event).model_dump_json() for n, event in enumerate((STARTED, STEP))]
    path.write_text("".join(f"{line}\n" for line in old))
    assert last_chain(tmp_path) == ""
    for event in (STEP, STEP):
        journal, _ = Journal.reopen(tmp_path)
        with journal:
            journal.append(event)
    assert [record.event for record in read_journal(tmp_path)] == [STARTED, STEP, STEP, STEP]
    content = path.read_bytes()
    assert last_chain(tmp_path) == hashlib.sha256(content[: content.rindex(b',"chain"')]).hexdigest()
    path.write_bytes(content.replace(b'"rig":"r"', b'"rig":"q"'))
    with pytest.raises(BadInputError, match=r"journal\.jsonl:3: "):
        list(read_journal(tmp_path))


def test_a_write_that_failed_does_not_break_the_hash_chain(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = os.write
    with Journal(tmp_path) as journal:
        journal.append(STARTED)
        with monkeypatch.context() as patch:
            patch.setattr("workbench.session.journal.os.write", lambda file, data: write(file, data[:9]))
            with pytest.raises(StoppedError):
                journal.append(STEP)
        journal.append(STEP)
    assert [record.event for record in read_journal(tmp_path)] == [STARTED, STEP]


def test_control_characters_of_a_foreign_journal_are_shown(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.append(STEP.model_copy(update={"title": "T\x1b[2J\u202e"}))
    (record,) = read_journal(tmp_path)
    assert isinstance(record.event, StepStarted)
    assert record.event.title == r"T\x1b[2J\u202e"


def test_a_journal_is_never_written_over(tmp_path: Path) -> None:
    Journal(tmp_path).close()
    with pytest.raises(FileExistsError):
        Journal(tmp_path)


def test_a_full_disk_stops_the_session_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Journal(tmp_path) as journal:
        journal.append(STARTED)

        def no_space(handle: int, data: bytes) -> int:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("workbench.session.journal.os.write", no_space)
            with pytest.raises(StoppedError, match="No space left"):
                journal.append(STEP)
    assert [r.event for r in read_journal(tmp_path)] == [STARTED]


def test_no_journal(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="expected a session's journal"):
        list(read_journal(tmp_path))


def test_a_reopened_journal_counts_on_and_cuts_off_what_is_torn(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.append(STARTED)
    path = tmp_path / JOURNAL
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"n":1,"time_ns"')
    reopened, before = Journal.reopen(tmp_path)
    with reopened:
        assert path.read_bytes() == whole
        assert [record.event for record in before] == [STARTED]
        assert reopened.append(STEP).n == 1
    assert [record.event for record in read_journal(tmp_path)] == [STARTED, STEP]


def test_two_programs_never_write_one_session(tmp_path: Path) -> None:
    with Journal(tmp_path):
        assert is_running(tmp_path)
        with pytest.raises(BadInputError, match=str(tmp_path)) as caught:
            Journal.reopen(tmp_path)
        assert caught.value.exit_code == 2
    assert not is_running(tmp_path)
    assert not is_running(tmp_path / "none")
