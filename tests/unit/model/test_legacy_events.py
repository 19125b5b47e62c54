"""Events of version 0.1.0 as today's tables."""

from __future__ import annotations

from typing import Any

import pytest

from workbench.model.event import Record, TrialFinished, TrialProgress
from workbench.model.legacy_events import upgraded

ROWS = [{"standoff_mm": 500.0, "mean_error_mm": 0.25}, {"standoff_mm": 700.0, "missing": 3}]


def record(event: dict[str, Any]) -> Any:
    return Record.model_validate({"n": 0, "time_ns": 1, "event": event}).event


@pytest.mark.parametrize("kind", ["trial_finished", "simulation_finished"])
def test_rows_of_an_old_trial_become_a_table_of_their_keys(kind: str) -> None:
    event = record({"kind": kind, "trial": "accuracy", "rows": ROWS})
    assert isinstance(event, TrialFinished)
    (table,) = event.tables
    assert [(c.key, c.name, c.unit) for c in table.columns] == [
        ("standoff_mm", "standoff", "mm"),
        ("mean_error_mm", "mean error", "mm"),
        ("missing", "missing", ""),
    ]
    assert table.rows == ((500.0, 0.25, None), (700.0, None, 3))
    assert (table.text(0, 0), table.text(0, 1)) == ("500", "0.25")


def test_a_simulated_scene_becomes_progress_with_its_count_of_distances() -> None:
    scene = {"name": "flat, near", "source": "figure 21"}
    event = record({"kind": "scene_simulated", "trial": "thesis", "scene": scene, "set_mm": [1.0, 2.0, 3.0]})
    assert isinstance(event, TrialProgress)
    assert event.trial == "thesis"
    for word in ("flat, near", "figure 21", "3"):
        assert word in event.text


@pytest.mark.parametrize(
    "event",
    [None, "text", 3, {"kind": "trial_finished", "trial": "t"}, {"kind": "step_finished"}, {"rows": []}],
)
def test_anything_else_stays_as_it_is(event: Any) -> None:
    assert upgraded(event) is event
