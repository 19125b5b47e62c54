"""Random numbers by name."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.emulator.keyed import generator


def test_keys_do_not_run_into_each_other() -> None:
    draws = [generator(1, *key).random() for key in (("ab", "c"), ("a", "bc"), ("abc",), ("c", "ab"))]
    assert len(set(draws)) == 4
    assert generator(1, "ab", "c").random() == draws[0]
    assert generator(2, "ab", "c").random() != draws[0]


def test_parts_of_a_key_count_in_their_order_and_numbers_as_their_digits() -> None:
    assert generator(1, "a", "b").random() != generator(1, "b", "a").random()
    assert generator(1, "frame", 7).random() == generator(1, "frame", "7").random()


def test_draws_of_other_keys_do_not_move_a_generator() -> None:
    first = generator(1, "a").standard_normal(5)
    generator(1, "b").standard_normal(100)
    np.testing.assert_array_equal(generator(1, "a").standard_normal(5), first)


def test_keys_are_independent() -> None:
    draws = np.array([generator(1, "k", n).standard_normal() for n in range(2000)])
    # 2000 draws: mean to 0.022, deviation to 0.016, neighbours' correlation to 0.022.
    assert abs(draws.mean()) < 4 * 0.023
    assert draws.std() == pytest.approx(1.0, abs=4 * 0.016)
    assert abs(np.corrcoef(draws[1:], draws[:-1])[0, 1]) < 4 * 0.023
