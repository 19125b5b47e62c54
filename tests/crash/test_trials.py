"""A short trial that is killed at any record ends, resumed, with the same files, byte for byte."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.crash.killer import Killer, serving
from tests.crash.trials import differs, undisturbed
from workbench.model.event import SpotsFound
from workbench.session.journal import read_journal

TRIAL = "missing_spots_trial"
DRIVE = "drive"
MIDDLE_OF_A_DRIVE = 15
"""Record of the short drive that is killed: of its third step."""
RECORDS = 21
"""Of the short trial; a test compares this number with the journal."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Session without a kill."""
    return undisturbed(tmp_path_factory.mktemp("whole"), TRIAL)


@pytest.fixture(scope="module")
def killer(whole: Path) -> Iterator[Killer]:
    with serving(whole.parent) as found:
        yield found


def test_number_of_records(whole: Path) -> None:
    assert len(list(read_journal(whole))) == RECORDS


@pytest.mark.parametrize(
    "record",
    [pytest.param(n, marks=() if n % 2 == 0 else pytest.mark.thorough) for n in range(RECORDS)],
)
def test_a_trial_killed_at_a_record_gives_the_same_files(
    tmp_path: Path, whole: Path, killer: Killer, record: int
) -> None:
    assert differs(killer, whole, tmp_path, record) == ""


@pytest.mark.thorough
def test_a_drive_killed_on_its_way_is_driven_again(tmp_path: Path) -> None:
    driven = undisturbed(tmp_path, DRIVE)
    event = list(read_journal(driven))[MIDDLE_OF_A_DRIVE].event
    assert isinstance(event, SpotsFound)
    with serving(tmp_path) as killer:
        assert differs(killer, driven, tmp_path / "killed", MIDDLE_OF_A_DRIVE) == ""
