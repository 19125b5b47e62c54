"""Run of chunks: each once, a bounded number at a time, with causes of failures named."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import distributed
import pytest
from distributed.client import FutureCancelledError
from distributed.scheduler import WorkerState

from tests.support.campaigns import SIMULATE, simulated_campaign
from workbench.campaign.folder import CampaignFolder, open_folder
from workbench.campaign.run import AHEAD, FEWEST_AHEAD, run_chunks
from workbench.model.errors import BadInputError, StoppedError

WORKERS = 12


class Done:
    """Result of a chunk, or its failure."""

    def __init__(self, error: Exception | None) -> None:
        self.error = error

    def result(self) -> None:
        if self.error is not None:
            raise self.error


@dataclass
class FakeClient:
    """Client that finishes every chunk as soon as it is asked for one."""

    failures: dict[int, Exception] = field(default_factory=dict)
    submitted: list[int] = field(default_factory=list)

    def nthreads(self) -> dict[str, int]:
        return {str(n): 1 for n in range(WORKERS)}

    def submit(self, function: object, manifest: str, path: str, index: int, key: str) -> Done:
        self.submitted.append(index)
        return Done(self.failures.get(index))


class InOrder(list[Done]):
    """Results in the order of their submission; counts those that wait."""

    most = 0

    def __iter__(self) -> Iterator[Done]:
        while self:
            type(self).most = max(type(self).most, len(self))
            yield self.pop(0)

    add = list.append


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[CampaignFolder]:
    monkeypatch.setattr(distributed, "as_completed", InOrder)
    InOrder.most = 0
    text = SIMULATE.replace("sensors: 40", "sensors: 3200")
    with open_folder(tmp_path / "out", simulated_campaign(tmp_path, text)) as found:
        yield found


def run(folder: CampaignFolder, client: FakeClient) -> list[int]:
    finished: list[int] = []
    dask = cast(distributed.Client, client)
    run_chunks(dask, folder, folder.missing(), lambda chunk: finished.append(chunk.index))
    return finished


def test_each_chunk_is_computed_once(folder: CampaignFolder) -> None:
    client = FakeClient()
    assert run(folder, client) == client.submitted == list(range(200))


def test_a_bounded_number_of_chunks_is_at_the_scheduler(folder: CampaignFolder) -> None:
    run(folder, FakeClient())
    assert InOrder.most == max(FEWEST_AHEAD, AHEAD * WORKERS) < 200


@pytest.mark.parametrize(
    ("failure", "expected", "words"),
    [
        (BadInputError("another version"), BadInputError, "another version"),
        (FutureCancelledError("key", "lost"), StoppedError, "connection to the scheduler was lost"),
        (OSError(28, "No space left on device"), StoppedError, "chunk 5: cannot be written.*No space left"),
    ],
)
def test_a_failure_ends_the_run(
    folder: CampaignFolder, failure: Exception, expected: type[Exception], words: str
) -> None:
    with pytest.raises(expected, match=words):
        run(folder, FakeClient({5: failure}))


def test_a_chunk_that_takes_every_worker_with_it_is_named(folder: CampaignFolder) -> None:
    killed = distributed.KilledWorker("task", cast(WorkerState, None), 3)
    with pytest.raises(StoppedError, match=r"chunk 5 \(calibration 80 to 95\): every worker"):
        run(folder, FakeClient({5: killed}))
