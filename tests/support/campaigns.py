"""Campaign files of tests, and their environment."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from workbench.campaign.campaign_file import Campaign, load_campaign
from workbench.campaign.identity import ENVIRONMENT

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
SIMULATE = f"""format: 1
campaign: small
title: Some sensors
seed: 7
work:
  kind: simulate
  rig: {RIG}
  sensors: 40
  chunk: 16
  standoffs_mm: [125, 160, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500]
  ranges_mm: [300, 3000]
"""


def write_campaign(folder: Path, text: str = SIMULATE, name: str = "campaign.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def simulated_campaign(folder: Path, text: str = SIMULATE) -> Campaign:
    return load_campaign(write_campaign(folder, text))


def frames_of(campaign: Campaign, folder: Path = Path()) -> list[pd.DataFrame]:
    """Results of all chunks, computed in this process."""
    return [campaign.file.work.run(campaign.inputs, chunk, folder) for chunk in campaign.chunks]


def as_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process pass for a worker; its threads are more, so that last bits may differ from one."""
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
