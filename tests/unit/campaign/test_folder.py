"""Folder of a campaign: created once, opened again by the same campaign alone."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.campaigns import SIMULATE, simulated_campaign
from workbench.campaign.chunk_file import write_chunk
from workbench.campaign.folder import MANIFEST, open_folder
from workbench.model.errors import BadInputError


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
    with pytest.raises(BadInputError, match="found other files"), open_folder(tmp_path, campaign):
        pass
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / MANIFEST).write_text("{}")
    with pytest.raises(BadInputError, match="manifest"), open_folder(tmp_path / "out", campaign):
        pass


def test_half_written_files_are_removed(tmp_path: Path) -> None:
    campaign = simulated_campaign(tmp_path)
    with open_folder(tmp_path / "out", campaign) as folder:
        left = folder.chunks / ".000001.parquet.abcd"
        left.write_bytes(b"half")
    with open_folder(tmp_path / "out", campaign):
        assert not left.exists()
