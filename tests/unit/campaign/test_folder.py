"""Folder of a campaign: created once, opened again by the same campaign alone."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pytest

from tests.support.campaigns import SIMULATE, simulated_campaign
from workbench.campaign.chunk_file import write_chunk
from workbench.campaign.folder import MANIFEST, open_folder
from workbench.campaign.lock import writer_lock
from workbench.model.errors import BadInputError
from workbench.session.files import write_atomically


def test_a_folder_opens_again_with_its_finished_chunks(tmp_path: Path) -> None:
    campaign = simulated_campaign(tmp_path)
    out = tmp_path / "out"
    with open_folder(out, campaign) as folder:
        assert folder.missing() == campaign.chunks
        write_chunk(folder.chunks, campaign.chunks[1], folder.identity.sha256, pd.DataFrame({"a": [1.0]}))
    with open_folder(out, campaign) as folder:
        assert folder.missing() == [campaign.chunks[0], campaign.chunks[2]]
        with pytest.raises(BadInputError, match=r"000000\.parquet"):
            list(folder.frames())


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [("seed: 7", "seed: 8", "seed 8, got those of seed 7"), ("campaign: small", "campaign: large", "large")],
)
def test_a_folder_of_another_campaign_is_refused(tmp_path: Path, before: str, after: str, words: str) -> None:
    out = tmp_path / "out"
    with open_folder(out, simulated_campaign(tmp_path)):
        pass
    stored = (out / MANIFEST).read_bytes()
    other = simulated_campaign(tmp_path, SIMULATE.replace(before, after))
    with (
        pytest.raises(BadInputError, match=rf"{words}.*Name another folder with -o"),
        open_folder(out, other),
    ):
        pass
    assert (out / MANIFEST).read_bytes() == stored


def test_results_of_another_code_version_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign = simulated_campaign(tmp_path)
    with open_folder(tmp_path / "out", campaign):
        pass
    monkeypatch.setattr("workbench.campaign.identity.code_sha256", lambda: "f" * 64)
    with (
        pytest.raises(BadInputError, match=r"this version of the workbench \(code ffffffffffff\)"),
        open_folder(tmp_path / "out", campaign),
    ):
        pass


def test_two_programs_cannot_use_one_folder(tmp_path: Path) -> None:
    campaign = simulated_campaign(tmp_path)
    with (
        open_folder(tmp_path / "out", campaign),
        pytest.raises(BadInputError, match="another program"),
        open_folder(tmp_path / "out", campaign),
    ):
        pass


def test_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    campaign = simulated_campaign(tmp_path)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(BadInputError, match="found other files"), open_folder(tmp_path, campaign):
        pass
    assert sorted(tmp_path.iterdir()) == before, "nothing is written into it"
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / MANIFEST).write_text("{}")
    with pytest.raises(BadInputError, match="manifest"), open_folder(tmp_path / "out", campaign):
        pass


def test_two_programs_that_start_at_once_cannot_use_a_new_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second one starts while the first one writes the manifest."""
    campaign, written = simulated_campaign(tmp_path), list[Path]()

    def write_slowly(path: Path, content: bytes) -> None:
        written.append(path)
        if len(written) == 1:
            with (
                pytest.raises(BadInputError, match="another program"),
                open_folder(tmp_path / "out", campaign),
            ):
                pass
        write_atomically(path, content)

    monkeypatch.setattr("workbench.campaign.folder.write_atomically", write_slowly)
    with open_folder(tmp_path / "out", campaign):
        assert written == [tmp_path / "out" / MANIFEST]


def test_locks_are_such_as_nfs_accepts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An exclusive lock needs a handle for writing, a shared one a handle for reading (flock(2))."""
    flock, modes = fcntl.flock, list[int]()

    def nfs_flock(handle: int, how: int) -> None:
        mode = fcntl.fcntl(handle, fcntl.F_GETFL) & os.O_ACCMODE
        modes.append(mode)
        refused = os.O_RDONLY if how & fcntl.LOCK_EX else os.O_WRONLY
        if mode == refused:
            raise OSError(errno.EBADF, "Bad file descriptor")
        flock(handle, how)

    monkeypatch.setattr(fcntl, "flock", nfs_flock)
    with open_folder(tmp_path / "out", simulated_campaign(tmp_path)) as folder, writer_lock(folder.path):
        assert len(modes) == 3


OURS = (
    ".campaign.json.0123abcd",
    ".report.html.0123abcd",
    "chunks/.000001.parquet.0123abcd",
    "chunks/.1234567.sha256.0123abcd",
    "files/.rig-000001.yaml.0123abcd",
    "files/.procedure-1.yaml.0123abcd",
    "tables/.ranges.csv.0123abcd",
    f"sessions/.000000-short-{'0' * 32}/000000-short/journal.jsonl",
)
"""Remains of programs that were killed."""
FOREIGN = (
    "chunks/.ipynb_checkpoints/000000-checkpoint.parquet",
    "chunks/.nfs0000000000000001",
    "chunks/.000001.parquet.swp",
    "chunks/notes.txt",
    "sessions/.git/config",
    "sessions/.000000-short/journal.jsonl",
    ".directory",
)


def put(folder: Path, names: Sequence[str]) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("something")


def test_own_remains_are_removed_and_other_files_stay(tmp_path: Path) -> None:
    campaign, out = simulated_campaign(tmp_path), tmp_path / "out"
    with open_folder(out, campaign):
        put(out, (*OURS, *FOREIGN))
    assert not any((out / name).exists() for name in OURS), "at the end"
    put(out, OURS)  # as of a program that was killed
    with open_folder(out, campaign) as folder:
        assert not any((out / name).exists() for name in OURS), "at the beginning"
        assert folder.missing() == campaign.chunks
    assert all((out / name).exists() for name in FOREIGN)
    assert not list((out / "sessions").glob(".000000-short-0*"))


def test_remains_of_a_manifest_are_no_other_files(tmp_path: Path) -> None:
    """A program that was killed while it wrote the manifest, the first file of the folder."""
    out = tmp_path / "out"
    put(out, [".campaign.json.0123abcd"])
    with open_folder(out, simulated_campaign(tmp_path)):
        assert not (out / ".campaign.json.0123abcd").exists()


def test_files_of_a_worker_that_still_writes_stay(tmp_path: Path) -> None:
    """One of an earlier program, at a scheduler that runs on."""
    campaign, out = simulated_campaign(tmp_path), tmp_path / "out"
    with open_folder(out, campaign):
        pass
    with writer_lock(out):
        put(out, OURS)
        with open_folder(out, campaign):
            pass
        assert all((out / name).exists() for name in OURS)
    with open_folder(out, campaign):
        assert not any((out / name).exists() for name in OURS)
