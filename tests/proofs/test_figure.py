"""Figures of a proof and their bounds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.proofs.figure import Bounds, Figure, KnownMiss


@pytest.mark.parametrize(
    ("value", "bounds", "runs", "missed"),
    [
        (0.05, (0, 0.05), 200, False),
        (0.06, (0, 0.05), 200, False),  # 12 of 200 occur by chance
        (0.09, (0, 0.05), 200, True),
        (0.065, (0, 0.05), 2000, True),
        (0.885, (0.93, 0.97), 200, True),
        (0.92, (0.93, 0.97), 200, False),
        (1.0, (0.93, 0.97), 200, True),
        (0.0, (1, 1), 1, True),
        (0.0, (0, 0), 1, False),
    ],
)
def test_a_share_is_missed_where_its_runs_contradict_the_bound(
    value: float, bounds: Bounds, runs: int, missed: bool
) -> None:
    figure = Figure("t", "q", value, bounds, runs)
    assert figure.is_missed is missed
    assert ("MISSED" in figure.line()) is missed


@pytest.mark.parametrize(("value", "missed"), [(0.09, False), (0.15, False), (0.29, True), (-0.29, True)])
def test_a_mean_is_missed_by_its_own_scatter(value: float, missed: bool) -> None:
    """The standard error is 0.07."""
    assert Figure("t", "q", value, (-0.1, 0.1), 200, sd=1.0).is_missed is missed


def test_a_known_miss_is_printed_with_its_reason_and_keeps_bounds_of_its_own() -> None:
    figure = Figure("t", "q", 0.82, (0.95, 1), 200, known=KnownMiss("another ruler", (0.8, 1)))
    assert figure.is_missed
    assert not figure.is_unjustified
    assert "another ruler" in figure.line()
    worse = replace(figure, value=0.5)
    assert worse.is_unjustified
    assert "another ruler" not in worse.line()
    assert replace(figure, known=None).is_unjustified


def test_information_is_never_missed() -> None:
    assert not Figure("t", "q", 0.5, None, 200).is_missed
