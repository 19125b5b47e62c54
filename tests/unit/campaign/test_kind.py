"""Items, chunks and their random numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.campaigns import SIMULATE, simulated_campaign
from workbench.campaign.kind import Chunk


@pytest.mark.parametrize(("sensors", "chunk"), [(40, 16), (48, 16), (1, 16), (16, 1)])
def test_chunks_contain_each_item_once_in_order(tmp_path: Path, sensors: int, chunk: int) -> None:
    text = SIMULATE.replace("sensors: 40", f"sensors: {sensors}").replace("chunk: 16", f"chunk: {chunk}")
    chunks = simulated_campaign(tmp_path, text).chunks
    assert [item for one in chunks for item in one.items] == list(range(sensors))
    assert [one.index for one in chunks] == list(range(len(chunks)))
    assert all(len(one.items) == chunk for one in chunks[:-1])


def test_random_numbers_depend_on_seed_and_index_alone() -> None:
    def drawn(seed: int, index: int) -> list[float]:
        return [float(one) for one in Chunk(index, range(3), seed).rng().random(5)]

    several = {(seed, index): drawn(seed, index) for seed in (1, 2) for index in (0, 1, 1000)}
    assert len({tuple(numbers) for numbers in several.values()}) == len(several)
    assert drawn(2, 1000) == several[2, 1000]
    spawned = np.random.SeedSequence(2).spawn(2)[1]
    assert drawn(2, 1) == np.random.default_rng(spawned).random(5).tolist()
