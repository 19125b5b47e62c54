"""Files of results: tables, and a page with what they depend on."""

from __future__ import annotations

import pandas as pd
import pytest

from tests.support.campaigns import frames_of, simulated_campaign
from workbench.campaign.chunk_file import write_chunk
from workbench.campaign.folder import CampaignFolder, open_folder
from workbench.campaign.results import page_path, summarise, write_results


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> CampaignFolder:
    base = tmp_path_factory.mktemp("campaign")
    campaign = simulated_campaign(base)
    with open_folder(base / "out", campaign) as found:
        for chunk, frame in zip(campaign.chunks, frames_of(campaign), strict=True):
            write_chunk(found.chunks, chunk, found.identity.sha256, frame)
        write_results(found, summarise(found))
    return found


def test_tables_are_csv_and_parquet(folder: CampaignFolder) -> None:
    for table in summarise(folder).tables:
        path = folder.path / "tables" / table.name
        assert path.with_suffix(".csv").read_text() == table.to_csv()
        stored = pd.read_parquet(path.with_suffix(".parquet"))
        assert stored.columns.tolist() == [column.key for column in table.columns]
        assert len(stored) == len(table.rows)


def test_the_page_states_result_and_origin(folder: CampaignFolder) -> None:
    page = page_path(folder).read_text()
    assert "Campaign small" in page
    assert folder.identity.code_sha256 in page
    assert folder.identity.inputs_sha256["rig"] in page
    assert page.count("<svg") == 3


def test_the_folder_of_chunks_is_one_data_set(folder: CampaignFolder) -> None:
    paths = sorted(folder.chunks.glob("*.parquet"))
    every = pd.concat([pd.read_parquet(path) for path in paths])
    assert every["sensor"].tolist() == list(range(40))
