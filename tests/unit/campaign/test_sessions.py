"""Campaign `sessions`: virtual sessions of drawn sensors, kept with their frames."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.crash.short import CALIBRATION, ROOT, write_files
from tests.support.campaigns import frames_of, write_campaign
from workbench.campaign.campaign_file import Campaign, load_campaign
from workbench.campaign.folder import open_folder
from workbench.campaign.sessions import SESSIONS
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError, RigNotReadyError
from workbench.model.event import FitFinished, SessionFinished
from workbench.procedure.engine import run as engine
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.plan import Plan
from workbench.session.journal import read_journal
from workbench.session.manifest import load_manifest
from workbench.session.state import session_status

TEXT = """format: 1
campaign: virtual
title: Virtual sessions
seed: 3
work:
  kind: sessions
  rig: rig.yaml
  procedures: [p.yaml]
  sensors: 2
  chunk: 2
"""


def campaign_of(folder: Path, text: str = TEXT, procedure: str = CALIBRATION) -> Campaign:
    folder.mkdir(exist_ok=True)
    write_files(folder, procedure)
    return load_campaign(write_campaign(folder, text))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Campaign, pd.DataFrame]:
    folder = tmp_path_factory.mktemp("sessions")
    campaign = campaign_of(folder)
    return folder, campaign, frames_of(campaign, folder)[0]


def test_each_session_is_whole_and_of_another_sensor(done: tuple[Path, Campaign, pd.DataFrame]) -> None:
    folder, _, rows = done
    assert rows["session"].tolist() == ["000000-short", "000001-short"]
    assert sorted(path.name for path in (folder / SESSIONS).iterdir()) == rows["session"].tolist()
    for row in rows.itertuples():
        session = folder / SESSIONS / str(row.session)
        assert session_status(session).state == "finished"
        assert load_manifest(session).rig.serial == row.serial
        calibration = load_calibration(session / "calibration.yaml").laser_ranger
        assert (row.now, row.before) == ("accepted", "none")
        assert row.rms_px_now == calibration.fit.rms_px
        assert row.relative_sd_now == calibration.validity.max_relative_range_sd
    assert rows["serial"].nunique() == rows["rms_px_now"].nunique() == 2


def test_a_repeated_chunk_has_the_same_rows(done: tuple[Path, Campaign, pd.DataFrame]) -> None:
    folder, campaign, rows = done
    session = folder / SESSIONS / "000001-short"
    first = session / "journal.jsonl"
    before = first.read_bytes()
    shutil.rmtree(folder / SESSIONS / "000000-short")
    again = frames_of(campaign, folder)[0]
    pd.testing.assert_frame_equal(again, rows, check_exact=True)
    assert first.read_bytes() == before


def test_a_refused_session_has_the_reason(tmp_path: Path) -> None:
    campaign = campaign_of(
        tmp_path,
        TEXT.replace("sensors: 2", "sensors: 1"),
        CALIBRATION.replace("max_relative_range_sd: 0.5", "max_rms_px: 0.0001"),
    )
    (rows,) = frames_of(campaign, tmp_path)
    records = read_journal(tmp_path / SESSIONS / "000000-short")
    (fit,) = [one.event for one in records if isinstance(one.event, FitFinished)]
    assert (rows["now"][0], rows["rms_px_now"][0]) == ("refused", fit.rms_px)
    assert "0.0001 px" in rows["reason"][0]
    summary = campaign.file.work.summarise(campaign.inputs, [rows])
    assert summary.headline == "0 of 1 sessions end with an accepted calibration"
    assert summary.tables[1].records()[0]["reason"] == rows["reason"][0]


def test_a_session_on_a_busy_computer_is_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps, ended = engine.run_steps, list[Path]()

    def disturbed(plan: Plan, context: Context) -> None:
        if not ended:
            ended.append(context.session_dir)
            context.emit(SessionFinished(exit_code=4, message="the lease ended"))
            raise RigNotReadyError("the lease ended")
        steps(plan, context)

    monkeypatch.setattr("workbench.procedure.engine.run.run_steps", disturbed)
    campaign = campaign_of(tmp_path, TEXT.replace("sensors: 2", "sensors: 1"))
    (rows,) = frames_of(campaign, tmp_path)
    assert len(ended) == 1
    assert rows["now"].tolist() == ["accepted"]


def test_parts_of_sessions_are_removed(tmp_path: Path) -> None:
    campaign = campaign_of(tmp_path)
    left = tmp_path / "out" / SESSIONS / ".000000-short-0" / "000000-short"
    with open_folder(tmp_path / "out", campaign):
        left.mkdir(parents=True)
    assert not list((tmp_path / "out" / SESSIONS).iterdir()), "at the end"
    left.mkdir(parents=True)  # as of a client that was killed
    with open_folder(tmp_path / "out", campaign):
        assert not list((tmp_path / "out" / SESSIONS).iterdir()), "at the beginning"


def test_real_lasers_are_refused(tmp_path: Path) -> None:
    rig = ROOT / "rigs/uno-webcam.yaml"
    with pytest.raises(
        BadInputError, match=r"campaign\.yaml:7: work\.rig: .*a campaign switches no laser on"
    ):
        campaign_of(tmp_path, TEXT.replace("rig.yaml", str(rig)))


def test_a_wrong_procedure_is_named_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"campaign\.yaml:8: work\.procedures: .*frames: is missing"):
        campaign_of(tmp_path, procedure=CALIBRATION.replace("capture_grid", "warm_up"))
