"""What a share of full scale is called."""

from __future__ import annotations

import pytest

from workbench.model.exposure import AIM, CLIPPED, GOOD, Verdict, verdict_of


@pytest.mark.parametrize(
    ("peak", "verdict"),
    [
        (0.0, "dim"),
        (0.549, "dim"),
        (0.55, "good"),
        (0.7, "good"),
        (0.701, "bright"),
        (0.999, "bright"),
        (1.0, "clipped"),
        (1.2, "clipped"),
    ],
)
def test_limits_belong_to_what_is_good(peak: float, verdict: Verdict) -> None:
    assert verdict_of(peak, seen=True) == verdict


@pytest.mark.parametrize("peak", [0.1, AIM, 1.0])
def test_where_no_laser_is_seen_nothing_is_good(peak: float) -> None:
    assert verdict_of(peak, seen=False) == "unseen"


def test_what_is_aimed_at_is_good() -> None:
    assert GOOD[0] < AIM < GOOD[1] < CLIPPED
