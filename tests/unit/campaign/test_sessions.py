"""Campaign `sessions`: virtual sessions of drawn sensors, kept with their frames."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.crash.short import CALIBRATION, ROOT, write_files
from tests.support.campaigns import as_worker, frames_of, write_campaign
from workbench.campaign.campaign_file import Campaign, load_campaign
from workbench.campaign.folder import MANIFEST, open_folder
from workbench.campaign.sessions import FILES, MOST_RESUMED, SESSION_ASIDE, SESSION_FILES, SESSIONS
from workbench.campaign.worker import run_chunk
from workbench.cli.exit import report
from workbench.model.calibration import load_calibration
from workbench.model.errors import (
    AnswerNeededError,
    BadInputError,
    LaserOffNotConfirmedError,
    LeaseEndedError,
    StoppedError,
    WorkbenchError,
)
from workbench.model.event import FitFinished, SessionFinished
from workbench.procedure.engine import resume as resumption
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
ONE = TEXT.replace("sensors: 2", "sensors: 1")


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
    assert all(re.fullmatch(SESSION_FILES, path.name) for path in (folder / FILES).iterdir())


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
        ONE,
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


class Disturbed:
    """Steps of sessions of which the first ones end with an error, as the engine journals it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, error: WorkbenchError, ends: int) -> None:
        self.error, self.ends, self.runs = error, ends, 0
        self.steps = engine.run_steps
        monkeypatch.setattr(engine, "run_steps", self)
        monkeypatch.setattr(resumption, "run_steps", self)

    def __call__(self, plan: Plan, context: Context) -> None:
        assert SESSION_ASIDE.fullmatch(context.session_dir.parent.name), "its remains would stay"
        self.runs += 1
        if self.runs <= self.ends:
            context.emit(SessionFinished(exit_code=self.error.exit_code, message=str(self.error)))
            raise self.error
        self.steps(plan, context)


def test_a_session_on_a_busy_computer_is_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disturbed = Disturbed(monkeypatch, LeaseEndedError("the lease ended"), MOST_RESUMED)
    campaign = campaign_of(tmp_path, ONE)
    (rows,) = frames_of(campaign, tmp_path)
    assert disturbed.runs == MOST_RESUMED + 1
    assert rows["now"].tolist() == ["accepted"]


@pytest.mark.parametrize(
    ("error", "ends", "expected", "words"),
    [
        (
            LeaseEndedError("lease over"),
            MOST_RESUMED + 1,
            StoppedError,
            "5 times, did not finish.*lease over",
        ),
        (
            StoppedError("no space left"),
            1,
            StoppedError,
            "000000-short did not finish.*no space left",
        ),
        (LaserOffNotConfirmedError("off?"), 1, StoppedError, "000000-short did not finish.*off"),
        (AnswerNeededError("which card"), 1, StoppedError, "000000-short did not finish.*which card"),
        (BadInputError("no captures"), 1, BadInputError, "session 000000-short: no captures"),
    ],
)
def test_a_session_that_did_not_finish_is_no_result(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    done: tuple[Path, Campaign, pd.DataFrame],
    error: WorkbenchError,
    ends: int,
    expected: type[WorkbenchError],
    words: str,
) -> None:
    """The chunk is not written, nothing of the session is kept, and the next run does it again."""
    disturbed = Disturbed(monkeypatch, error, ends)
    campaign = campaign_of(tmp_path)
    as_worker(monkeypatch)
    with open_folder(tmp_path / "out", campaign) as folder:
        manifest = (folder.path / MANIFEST).read_text()
        with pytest.raises(expected, match=words) as caught:
            run_chunk(manifest, str(folder.path), 0)
        assert report(caught.value) == expected.exit_code, "virtual lasers that may be on are no danger"
        assert folder.missing() == campaign.chunks
        assert not list((folder.path / SESSIONS).iterdir())
        run_chunk(manifest, str(folder.path), 0)
        (rows,) = folder.frames()
    assert disturbed.runs == ends + 2
    pd.testing.assert_frame_equal(rows, done[2])


def test_a_folder_of_an_unfinished_session_is_no_result(
    tmp_path: Path, done: tuple[Path, Campaign, pd.DataFrame]
) -> None:
    folder, campaign, _ = done
    shutil.copytree(folder / SESSIONS, tmp_path / SESSIONS)
    journal = tmp_path / SESSIONS / "000001-short" / "journal.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:-1]))
    with pytest.raises(BadInputError, match=r"000001-short: expected .* got one that is interrupted"):
        frames_of(campaign, tmp_path)


def test_real_lasers_are_refused(tmp_path: Path) -> None:
    rig = ROOT / "rigs/uno-webcam.yaml"
    with pytest.raises(
        BadInputError, match=r"campaign\.yaml:7: work\.rig: .*a campaign switches no laser on"
    ):
        campaign_of(tmp_path, TEXT.replace("rig.yaml", str(rig)))


def test_a_wrong_procedure_is_named_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"campaign\.yaml:8: work\.procedures: .*frames: is missing"):
        campaign_of(tmp_path, procedure=CALIBRATION.replace("capture_grid", "warm_up"))
