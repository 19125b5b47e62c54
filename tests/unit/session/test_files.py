"""Files that are whole or not there."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError, StoppedError
from workbench.session.files import (
    check_output,
    temporary_pattern,
    write_atomically,
    write_output,
    write_record,
)


def test_an_interrupted_write_leaves_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a"
    write_atomically(path, b"old")

    def pulled(self: Path, target: Path) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", pulled)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, b"new")
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {"a": b"old"}


def test_the_pattern_of_temporary_files_is_that_of_their_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, names = Path.replace, list[str]()

    def replaced(self: Path, target: Path) -> Path:
        names.append(self.name)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", replaced)
    write_atomically(tmp_path / "7.csv", b"")
    (name,) = names
    assert temporary_pattern(r"\d\.csv").fullmatch(name)
    assert temporary_pattern(r"8\.xml|7\.csv").fullmatch(name)
    assert not temporary_pattern(r"\d\.parquet").fullmatch(name)
    assert not temporary_pattern(r"\d\.csv").fullmatch("7.csv")


def test_an_existing_file_is_replaced_whole_and_readable_by_all(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a longer text than the new one")
    write_output(path, b"new")
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode & 0o777 == 0o644
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_link_points_to_is_replaced_not_the_link(tmp_path: Path) -> None:
    target, link = tmp_path / "there/a.yaml", tmp_path / "a.yaml"
    target.parent.mkdir()
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_output(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("name", ["no/a.yaml", "folder", "fifo"])
def test_an_output_that_cannot_be_is_seen_before_the_work(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")
    for check in (check_output, lambda path: write_output(path, b"")):
        with pytest.raises(BadInputError, match=name) as caught:
            check(tmp_path / name)
        assert caught.value.exit_code == 2


def test_a_record_that_cannot_be_written_stops_the_session(tmp_path: Path) -> None:
    with pytest.raises(StoppedError, match="no/a") as caught:
        write_record(tmp_path / "no/a", b"")
    assert caught.value.exit_code == 5


@pytest.mark.parametrize("umask", [0o022, 0o027, 0o077])
def test_a_new_file_follows_the_umask_and_an_existing_one_keeps_its_mode(tmp_path: Path, umask: int) -> None:
    (tmp_path / "old").touch()
    (tmp_path / "old").chmod(0o640)
    before = os.umask(umask)
    try:
        for name in ("new", "old"):
            write_atomically(tmp_path / name, b"1")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o666 & ~umask
    assert stat.S_IMODE((tmp_path / "old").stat().st_mode) == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "old"]


def test_the_content_is_on_disk_before_the_rename_and_the_rename_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, synced = tmp_path / "a", []
    fsync = os.fsync

    def recorded(handle: int) -> None:
        synced.append((stat.S_ISDIR(os.fstat(handle).st_mode), path.exists()))
        fsync(handle)

    monkeypatch.setattr(os, "fsync", recorded)
    write_atomically(path, b"new")
    assert synced == [(False, False), (True, True)]
