"""Campaign `refit`: sessions of the repository, fitted again."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.support.campaigns import ROOT, frames_of, write_campaign
from workbench.campaign.campaign_file import Campaign, load_campaign
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError

REFERENCE = "20261130-085045-reference"
UNFITTED = "20261130-114530-calibrate-flat"
TEXT = """format: 1
campaign: again
title: Again
work:
  kind: refit
  sessions: sessions
  chunk: 4
"""


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("archive")
    for name in (REFERENCE, UNFITTED):
        shutil.copytree(ROOT / "data/sessions" / name, folder / "sessions" / name)
    return folder


def campaign_of(archive: Path, more: str = "") -> Campaign:
    return load_campaign(write_campaign(archive, TEXT + more))


@pytest.fixture(scope="module")
def same_model(archive: Path) -> list[pd.DataFrame]:
    return frames_of(campaign_of(archive))


def test_the_same_model_gives_the_calibration_of_the_session(
    archive: Path, same_model: list[pd.DataFrame]
) -> None:
    row = pd.concat(same_model).set_index("session").loc[REFERENCE]
    fit = load_calibration(archive / "sessions" / REFERENCE / "calibration.yaml").laser_ranger.fit
    assert (row["before"], row["now"]) == ("accepted", "accepted")
    assert row["rms_px_before"] == fit.rms_px
    # The solver stops at 1e-6 of a standard deviation, or below.
    assert row["rms_px_now"] == pytest.approx(fit.rms_px, rel=1e-6)
    assert abs(row["difference_mm"]) < 1e-4 * row["difference_sd_mm"]


def test_sessions_that_cannot_be_fitted_have_the_reason(same_model: list[pd.DataFrame]) -> None:
    every = pd.concat(same_model).set_index("session")
    assert every.loc[UNFITTED, "now"] == "not fitted"
    assert every.loc[UNFITTED, "reason"]


def test_another_model_moves_ranges_and_limits_refuse(archive: Path, same_model: list[pd.DataFrame]) -> None:
    limits = "  limits: {max_rms_px: 0.001}\n"
    campaign = campaign_of(
        archive, f"  fix: [f_px]\n  of_rig: {_serial(archive)}\n  verdict: accepted\n{limits}"
    )
    frames = frames_of(campaign)
    assert pd.concat(frames)["session"].tolist() == [REFERENCE]
    assert abs(frames[0]["relative_difference"][0]) > 1e-4
    summary = campaign.file.work.summarise(campaign.inputs, [*same_model, *frames])
    assert summary.headline.startswith("2 of 3 sessions are fitted, 1 accepted")
    verdicts, sessions = summary.tables
    counts = {(row["before"], row["now"]): row["sessions"] for row in verdicts.records()}
    assert counts == {("accepted", "accepted"): 1, ("accepted", "refused"): 1, ("none", "not fitted"): 1}
    assert "0.001 px" in frames[0]["reason"][0]
    assert [row["session"] for row in sessions.records()] == [UNFITTED, REFERENCE, REFERENCE]


@pytest.mark.parametrize("edited", ["captures.csv", "a frame"])
def test_a_session_that_was_edited_is_not_fitted_and_named(tmp_path: Path, edited: str) -> None:
    session = Path(shutil.copytree(ROOT / "data/sessions" / REFERENCE, tmp_path / "sessions" / REFERENCE))
    if edited == "captures.csv":
        path = session / edited
        path.write_text(path.read_text().replace("L1,150.0,0,", "L1,151.0,0,", 1))
    else:
        first, other, *_ = sorted(session.glob("frames/reference.3/*/L1/*-on.png"))
        path = Path(shutil.copy(other, first))
    row = pd.concat(frames_of(campaign_of(tmp_path))).iloc[0]
    assert (row["session"], row["before"], row["now"]) == (REFERENCE, "accepted", "not fitted")
    assert row["reason"].startswith(f"{path}: ")
    assert pd.isna(row["rms_px_now"])


def test_a_worker_that_does_not_see_the_sessions_has_no_result(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "data/sessions" / UNFITTED, tmp_path / "sessions" / UNFITTED)
    campaign = campaign_of(tmp_path)
    (tmp_path / "sessions").rename(tmp_path / "elsewhere")
    with pytest.raises(BadInputError, match=rf"worker .*sessions/{UNFITTED}: expected a session, found none"):
        frames_of(campaign)


def test_a_query_without_sessions_is_refused(archive: Path) -> None:
    with pytest.raises(BadInputError, match=r"campaign\.yaml:6: work\.sessions: .*none is selected"):
        campaign_of(archive, "  until: 2020-01-01\n")


def test_an_unknown_parameter_is_refused_before_the_run(archive: Path) -> None:
    rig = ROOT / "rigs/thesis-emulated.yaml"
    with pytest.raises(BadInputError, match="focal"):
        campaign_of(archive, f"  rig: {rig}\n  fix: [focal]\n")


def _serial(archive: Path) -> str:
    from workbench.session.manifest import load_manifest

    return load_manifest(archive / "sessions" / REFERENCE).rig.serial
