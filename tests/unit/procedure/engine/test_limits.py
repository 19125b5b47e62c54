"""Limits on captures and fits."""

from __future__ import annotations

import pytest

from workbench.procedure.engine.limits import why_not_measured


@pytest.mark.parametrize(
    ("spots", "words"),
    [
        ([0], "no spot of L4 was found in 1 capture"),
        ([0] * 10, "no spot of L4 was found in 10 captures"),
        ([0, 2, 3], "L4 cannot be told among up to 3 spots in 3 captures"),
        ([1, 0], "scatter_px takes a spot of L4 in two captures or more"),
    ],
)
def test_why_a_quantity_was_not_measured(spots: list[int], words: str) -> None:
    assert why_not_measured("scatter_px", "L4", spots) == words
