"""Campaign files: mistakes are named with file and line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.campaigns import RIG, ROOT, SIMULATE, simulated_campaign, write_campaign
from workbench.campaign.campaign_file import CampaignFile, load_campaign
from workbench.model.errors import BadInputError

SCHEMA = ROOT / "docs/campaign.schema.json"


def test_a_campaign_contains_the_texts_of_the_files_it_names(tmp_path: Path) -> None:
    campaign = simulated_campaign(tmp_path)
    assert campaign.inputs == {"rig": RIG.read_text()}
    assert campaign.file.work.count(campaign.inputs) == 40


@pytest.mark.parametrize(
    ("before", "after", "line", "words"),
    [
        ("kind: simulate", "kind: simulated", 6, "one of"),
        ("sensors: 40", "sensors: 0", 8, "expected 1 to"),
        ("sensors: 40", "sensor: 40", 8, "no such key"),
        ("seed: 7", "seed: -1", 4, "at least 0"),
        ("campaign: small", "campaign: small one", 2, "letters"),
        ("[300, 3000]", "[300, 300]", 5, "each range once"),
        (str(RIG), "missing.yaml", 7, "missing.yaml"),
        ("title: Some sensors\n", "", 1, "title"),
    ],
)
def test_mistakes_are_named_with_file_and_line(
    tmp_path: Path, before: str, after: str, line: int, words: str
) -> None:
    assert before in SIMULATE
    path = write_campaign(tmp_path, SIMULATE.replace(before, after))
    with pytest.raises(BadInputError, match=words) as raised:
        load_campaign(path)
    assert str(raised.value).startswith(f"{path}:{line}: ")


def test_a_file_of_another_kind_is_named() -> None:
    with pytest.raises(BadInputError, match="expected a campaign, with the key campaign; this is a rig"):
        load_campaign(RIG)


@pytest.mark.parametrize("path", sorted(ROOT.glob("procedures/campaigns/*.yaml")), ids=lambda path: path.stem)
def test_example_campaigns_are_valid(path: Path, tmp_path: Path) -> None:
    text = path.read_text().replace("../../sessions", str(ROOT / "data/sessions"))
    text = text.replace("../../rigs", str(ROOT / "rigs")).replace("[../", f"[{ROOT / 'procedures'}/")
    assert load_campaign(write_campaign(tmp_path, text)).chunks


def test_the_schema_in_the_documentation_is_that_of_the_code() -> None:
    assert json.loads(SCHEMA.read_text()) == CampaignFile.model_json_schema()
