"""Sets of lasers whose spots are missing."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest

from workbench.model.target import Placement
from workbench.trials.missing_spots.sets import ALL, Condition, block_prompts, missing_sets

IDS = ("L1", "L2", "L3", "L4")


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("cause", ["off", "blocked"])
def test_every_set_occurs_as_often_as_any_other(number: int, cause: str) -> None:
    condition = Condition(number, "blocked" if cause == "blocked" else "off")
    counts = Counter(missing_sets(IDS, condition, 13))
    assert max(counts.values()) - min(counts.values()) <= 1
    assert all(len(ids) == number for ids in counts)


def test_with_all_lasers_no_spot_is_missing() -> None:
    assert missing_sets(IDS, ALL, 3) == [()] * 3


def test_a_set_is_blocked_once_at_a_placement() -> None:
    sets = missing_sets(IDS, Condition(1, "blocked"), 6)
    assert sum(a != b for a, b in pairwise(sets)) == 3
    prompts = block_prompts(Placement(key="p/1", standoff_mm=400.0), IDS, (1,), 6)
    assert len({prompt.key for prompt in prompts}) == len(prompts) == 5
    assert all(prompt.at_bench for prompt in prompts)
    assert block_prompts(Placement(key="p/1", standoff_mm=400.0), IDS, (), 6) == []
