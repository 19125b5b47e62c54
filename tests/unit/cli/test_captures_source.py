"""Captures file of a session, and the remedy where it has none: each remedy works."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.api import fit, open_session
from workbench.cli.captures_source import calibration_table
from workbench.model.errors import BadInputError
from workbench.session.journal import Journal

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A finished session whose captures file is gone."""
    folder = tmp_path / "20261129-174335-reference"
    shutil.copytree(SESSION, folder)
    (folder / "captures.csv").unlink()
    return folder


def remedy(folder: Path) -> str:
    with pytest.raises(BadInputError) as caught:
        calibration_table(folder)
    return str(caught.value)


def end_early(folder: Path) -> None:
    """Remove the last line of the journal, as if the session had been killed."""
    journal = folder / "journal.jsonl"
    journal.write_text("".join(journal.read_text().splitlines(keepends=True)[:-1]))


def without_fit(folder: Path) -> None:
    """Remove the fit step and all that need one from the procedure."""
    manifest = folder / "session.yaml"
    lines = manifest.read_text().splitlines(keepends=True)
    first = next(n for n, line in enumerate(lines) if "step: fit" in line)
    end = next(n for n, line in enumerate(lines) if line.startswith("versions:"))
    manifest.write_text("".join(lines[:first] + lines[end:]))


def test_files_and_sessions_have_their_table(tmp_path: Path) -> None:
    assert calibration_table(tmp_path / "c.csv") == tmp_path / "c.csv"
    assert calibration_table(SESSION) == SESSION / "captures.csv"


def test_a_session_that_can_write_it_is_resumed(session: Path) -> None:
    end_early(session)
    assert "workbench resume" in remedy(session)


def test_a_running_session_is_waited_for(session: Path) -> None:
    end_early(session)
    journal, _ = Journal.reopen(session)
    with journal:
        assert "running" in remedy(session)


@pytest.mark.parametrize("ended_early", [False, True])
def test_captures_without_a_fit_step_are_fitted_in_python(session: Path, ended_early: bool) -> None:
    without_fit(session)
    if ended_early:
        end_early(session)
    text = remedy(session)
    assert "captures_for_fit" in text
    assert "resume" not in text
    opened = open_session(session)
    assert fit(opened.captures_for_fit(), opened.rig).verdict == "accepted"


def test_a_session_without_captures_needs_another_procedure(session: Path, workbench: Run) -> None:
    journal = session / "journal.jsonl"
    journal.write_text("".join(journal.read_text().splitlines(keepends=True)[:1]))
    without_fit(session)
    text = remedy(session)
    assert "resume" not in text
    assert "captures_for_fit" not in text
    refused(workbench("fit", session, "-o", session.parent / "c.yaml"), 2, session)
