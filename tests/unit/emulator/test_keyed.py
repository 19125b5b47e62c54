"""Random numbers by name."""

from __future__ import annotations

from workbench.emulator.keyed import generator


def test_keys_do_not_run_into_each_other() -> None:
    draws = [generator(1, *key).random() for key in (("ab", "c"), ("a", "bc"), ("abc",), ("c", "ab"))]
    assert len(set(draws)) == 4
    assert generator(1, "ab", "c").random() == draws[0]
    assert generator(2, "ab", "c").random() != draws[0]
