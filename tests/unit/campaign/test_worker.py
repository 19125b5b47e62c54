"""Work of one chunk in a worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.campaigns import as_worker, simulated_campaign
from workbench.campaign import worker
from workbench.campaign.campaign_file import Campaign
from workbench.campaign.chunk_file import chunk_path, read_chunk
from workbench.campaign.folder import MANIFEST, open_folder
from workbench.campaign.lock import no_writer
from workbench.campaign.worker import run_chunk
from workbench.model.errors import BadInputError


@pytest.fixture
def campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Campaign:
    as_worker(monkeypatch)
    worker._read.cache_clear()
    return simulated_campaign(tmp_path)


def test_a_chunk_is_computed_and_then_kept(tmp_path: Path, campaign: Campaign) -> None:
    with open_folder(tmp_path / "out", campaign) as folder:
        manifest = (folder.path / MANIFEST).read_text()
        assert run_chunk(manifest, str(folder.path), 2) == 2
        found = read_chunk(folder.chunks, campaign.chunks[2], folder.identity.sha256)
        assert found["sensor"].tolist() == list(range(32, 40))
        written = chunk_path(folder.chunks, 2).stat().st_mtime_ns
        run_chunk(manifest, str(folder.path), 2)
        assert chunk_path(folder.chunks, 2).stat().st_mtime_ns == written


def test_a_worker_of_another_version_is_refused(
    tmp_path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_folder(tmp_path / "out", campaign) as folder:
        manifest = (folder.path / MANIFEST).read_text()
        monkeypatch.setattr("workbench.campaign.identity.code_sha256", lambda: "f" * 64)
        with pytest.raises(BadInputError, match="a worker differs from this program"):
            run_chunk(manifest, str(folder.path), 0)
    assert not list(folder.chunks.iterdir())


def test_a_worker_that_does_not_see_the_folder_is_named(tmp_path: Path, campaign: Campaign) -> None:
    with open_folder(tmp_path / "out", campaign) as folder:
        manifest = (folder.path / MANIFEST).read_text()
    elsewhere = tmp_path / "elsewhere"
    with pytest.raises(BadInputError, match=f"expected the folder of the campaign, {elsewhere}, found none"):
        run_chunk(manifest, str(elsewhere), 0)


def test_a_worker_holds_its_lock_while_it_writes(
    tmp_path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    quiet = list[bool]()

    def write(folder: Path, *others: object) -> None:
        with no_writer(folder.parent) as is_quiet:
            quiet.append(is_quiet)

    monkeypatch.setattr(worker, "write_chunk", write)
    with open_folder(tmp_path / "out", campaign) as folder:
        run_chunk((folder.path / MANIFEST).read_text(), str(folder.path), 0)
        with no_writer(folder.path) as is_quiet:
            quiet.append(is_quiet)
    assert quiet == [False, True]
