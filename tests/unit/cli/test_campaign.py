"""`workbench campaign`, as far as no worker is needed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.campaigns import SIMULATE, frames_of, simulated_campaign, write_campaign
from tests.support.command_line import Run, refused
from workbench.campaign.chunk_file import write_chunk
from workbench.campaign.folder import open_folder
from workbench.cli.campaign import Progress


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """Campaign file, with a finished folder `out` beside it."""
    path = write_campaign(tmp_path)
    campaign = simulated_campaign(tmp_path)
    with open_folder(tmp_path / "out", campaign) as folder:
        for chunk, frame in zip(campaign.chunks, frames_of(campaign), strict=True):
            write_chunk(folder.chunks, chunk, folder.identity.sha256, frame)
    return path


def test_a_finished_campaign_prints_its_results(workbench: Run, campaign: Path) -> None:
    outcome = workbench("campaign", campaign, "-o", campaign.parent / "out", "--json")
    assert outcome.code == 0
    assert {"decisions", "ranges", "parameters"} == json.loads(outcome.out).keys()
    assert "40 sensors: " in outcome.err
    assert max(map(len, outcome.err.splitlines()[:20])) <= 80
    assert (campaign.parent / "out/report.html").is_file()
    assert (campaign.parent / "out/recording.rrd").is_file()


def test_another_seed_is_refused_before_workers_start(workbench: Run, campaign: Path) -> None:
    write_campaign(campaign.parent, SIMULATE.replace("seed: 7", "seed: 8"))
    refused(workbench("campaign", campaign, "-o", campaign.parent / "out"), 2, "seed 8", "seed 7", "-o")


def test_workers_and_scheduler_exclude_each_other(workbench: Run, tmp_path: Path) -> None:
    options = ("-o", tmp_path / "out", "--workers", "1", "--scheduler", "tcp://127.0.0.1:8786")
    refused(workbench("campaign", write_campaign(tmp_path), *options), 2, "either --workers or --scheduler")


def test_check_knows_campaigns(workbench: Run, tmp_path: Path) -> None:
    path = write_campaign(tmp_path)
    assert f"{path}: good" in workbench("check", path).err.replace("\n", "")
    write_campaign(tmp_path, SIMULATE.replace("sensors: 40", "sensors: none"))
    refused(workbench("check", path), 2, f"{path}:8: work.sensors: expected a whole number")


def test_progress_has_rate_and_time_left(tmp_path: Path) -> None:
    now = [0.0]
    campaign = simulated_campaign(tmp_path)
    with open_folder(tmp_path / "out", campaign) as folder:
        progress = Progress(folder, campaign.chunks[1:], lambda: now[0])
        assert progress.text() == "16 of 40 (40 %), 0 per second, unknown time left"
        now[0] = 8.0
        progress.add(campaign.chunks[1])
        assert progress.text() == "32 of 40 (80 %), 2 per second, 4 s left"
