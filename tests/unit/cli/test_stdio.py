"""Standard streams that are closed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import SCRIPT, shell


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed(tmp_path: Path, closed: str) -> None:
    """What is opened next would get a closed one's number: a pipe, a session's journal."""
    done = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path}' {closed}")
    assert (done.returncode, done.stdout) == (0, "")
    assert "Traceback" not in done.stderr
    missing = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path / 'no'}' {closed}")
    assert missing.returncode == 2
