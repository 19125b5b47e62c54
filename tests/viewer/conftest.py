from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import rerun as rr

from tests.viewer.session import MadeUpSession, a_rig
from workbench.model.event import Record
from workbench.model.rig import Rig
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer


@dataclass(frozen=True)
class Recorded:
    """A made-up session and its recording."""

    folder: Path
    rig: Rig
    records: list[Record]

    @property
    def recording(self) -> Path:
        return self.folder / RECORDING_FILE


@pytest.fixture(autouse=True)
def strict_rerun() -> Iterator[None]:
    """Rerun only warns of bad data unless told to be strict."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(before)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    folder = tmp_path_factory.mktemp("session")
    records = list(MadeUpSession(folder).records())
    rig = a_rig()
    rr.set_strict_mode(True)
    with RecordingConsumer(folder, rig) as consumer:
        for record in records:
            consumer(record)
    return Recorded(folder, rig, records)
