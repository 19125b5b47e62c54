"""Records of ranges: notes, intervals, the range of a flat."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.support.rangers import spots
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.spots import Failure, Finding


@pytest.mark.parametrize(
    ("flag", "words"),
    [
        (Failure.SATURATED, "is saturated: its range is known less well"),
        (Failure.MERGED, "runs into another: both ranges err together"),
        (Failure.AT_EDGE, "is cut by the edge of the picture"),
    ],
)
def test_what_a_range_suffers_from_is_told(ranger: Ranger, flag: Failure, words: str) -> None:
    def shoot(ids: tuple[str, ...]) -> Finding:
        found = spots(ranger, dict.fromkeys(ids, 700.0))
        return Finding((replace(found[0], flags=frozenset({flag})), *found[1:]))

    reading = acquire(ranger, "s", shoot)
    assert (reading.status, reading.notes) == ("done", (f"L1: its spot {words}",))
