"""Text about a camera that adjusts itself."""

from __future__ import annotations

import pytest

from workbench.procedure.capture.automatic_advice import automatic_control_advice


@pytest.mark.parametrize(("darkening", "dimming"), [(0.17, None), (None, 0.17), (0.17, 0.4)])
def test_the_share_of_the_surer_sign_is_stated(darkening: float | None, dimming: float | None) -> None:
    assert " 17 %" in automatic_control_advice(darkening, dimming)


def test_without_a_sign_there_is_no_advice() -> None:
    assert automatic_control_advice(None, None) == ""
