"""Bounds of texts."""

from __future__ import annotations

from workbench.model.text_length import LONGEST_NAME, LONGEST_TEXT, length_error


def test_only_texts_beyond_the_bound_are_errors() -> None:
    assert length_error("x" * LONGEST_TEXT) == length_error("x" * LONGEST_NAME, LONGEST_NAME) == ""
    assert str(LONGEST_TEXT) in length_error("x" * (LONGEST_TEXT + 1))
    assert length_error("x" * (LONGEST_NAME + 1), LONGEST_NAME)
