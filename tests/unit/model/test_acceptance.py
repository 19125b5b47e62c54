"""Limits on a calibration: defaults and what is refused."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from workbench.model.acceptance import FEWEST_STANDOFFS, Acceptance


def test_without_a_word_a_pixel_and_five_per_cent_are_demanded() -> None:
    limits = Acceptance()
    assert (limits.max_rms_px, limits.max_relative_range_sd, limits.min_standoffs) == (1.0, 0.05, 3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_rms_px": 0.0},
        {"max_relative_range_sd": -0.01},
        {"min_standoffs": FEWEST_STANDOFFS - 1},
        {"max_rms_px": float("inf")},
        {"max_rms": 1.0},
    ],
)
def test_limits_that_say_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError) as caught:
        Acceptance.model_validate(wrong)
    (error,) = caught.value.errors()
    assert error["loc"] == tuple(wrong)
