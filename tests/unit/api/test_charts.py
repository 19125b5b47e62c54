"""Charts of recorded trials as figures."""

from __future__ import annotations

from pathlib import Path

import pytest

import workbench as wb

SESSIONS = Path(__file__).parents[3] / "data/sessions"


def test_a_chart_of_a_trial_is_drawn_with_its_series() -> None:
    (trial,) = wb.open_session(SESSIONS / "20261130-085045-reference").trials.values()
    chart = trial.charts[0]
    (axes,) = wb.draw(chart).axes
    assert axes.get_xlabel() == chart.x.text
    assert axes.get_ylabel() == chart.y.text


def test_anything_else_is_refused() -> None:
    with pytest.raises(wb.BadInputError):
        wb.draw("figure-21")  # type: ignore[arg-type]  # a wrong argument is meant
