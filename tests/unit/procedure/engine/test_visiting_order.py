"""Order of a grid's visits: no correlation of time with the standoff, and returns at the end."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.procedure.engine.visiting_order import returned, shuffled

GRIDS = (
    (125.0, 160.0, 210.0, 280.0, 400.0, 600.0, 900.0, 1400.0, 2200.0, 3200.0, 4500.0),
    (100.0, 300.0, 500.0, 700.0, 900.0, 1100.0, 1300.0, 1500.0),
    (2000.0, 40.0, 500.0, 90.0, 1000.0, 200.0),
)


@pytest.mark.parametrize("grid", GRIDS)
def test_time_correlates_with_no_scale_of_the_standoff(grid: tuple[float, ...]) -> None:
    order = np.array(shuffled(grid))
    assert sorted(order.tolist()) == sorted(grid)
    time = np.arange(len(order))
    for scale in (np.log(order), 1.0 / order):
        assert abs(np.corrcoef(time, scale)[0, 1]) < 0.1


def test_the_order_is_always_the_same_and_does_not_depend_on_how_it_is_listed() -> None:
    assert shuffled(GRIDS[0]) == shuffled(tuple(reversed(GRIDS[0])))


def test_two_standoffs_keep_their_order() -> None:
    assert shuffled((300.0, 100.0)) == (300.0, 100.0)


@pytest.mark.parametrize(("count", "expected"), [(0, ()), (1, (1400.0,)), (2, (1400.0, 3200.0))])
def test_returns_are_far_standoffs_of_the_grid(count: int, expected: tuple[float, ...]) -> None:
    assert returned(GRIDS[0], count) == expected


def test_a_single_standoff_is_returned_to_once() -> None:
    assert returned((500.0,), 2) == (500.0,)
