"""Events of sessions recorded by version 0.1.0, read as today's."""

from __future__ import annotations

import pytest

from workbench.model.event import Record, TrialFinished, TrialProgress
from workbench.model.legacy_events import upgraded


def read(event: dict[str, object]) -> object:
    return Record.model_validate({"n": 0, "time_ns": 0, "event": event}).event


def test_rows_of_an_old_trial_are_a_table_with_units_from_their_keys() -> None:
    rows = [{"standoff_mm": 500.0, "readings": 3, "sd_mm": None}, {"standoff_mm": 800.0, "angle_deg": 3.5}]
    event = read({"kind": "trial_finished", "trial": "p.8", "rows": rows})
    assert isinstance(event, TrialFinished)
    (table,) = event.tables
    assert (event.trial, table.name, event.charts) == ("p.8", "p.8", ())
    assert [(c.key, c.name, c.unit) for c in table.columns] == [
        ("standoff_mm", "standoff", "mm"),
        ("readings", "readings", ""),
        ("sd_mm", "sd", "mm"),
        ("angle_deg", "angle", "deg"),
    ]
    assert table.rows == ((500.0, 3, None, None), (800.0, None, None, 3.5))


def test_claims_of_an_old_simulation_are_a_table() -> None:
    rows = [
        {"scene": "a", "ours": 0.01, "reproduced": True, "better": True},
        {"scene": "b", "ours": 0.2, "reproduced": False, "better": False},
        {"scene": "c", "ours": 0.3, "reproduced": None, "better": True},
    ]
    event = read({"kind": "simulation_finished", "trial": "p.1", "rows": rows})
    assert isinstance(event, TrialFinished)
    (table,) = event.tables
    assert [row[:2] for row in table.rows] == [("a", 0.01), ("b", 0.2), ("c", 0.3)]
    # What was a success is no alarm.
    shown = [[table.text(row, column) for column in (2, 3)] for row in range(3)]
    assert shown == [["", ""], ["!", "!"], ["", ""]]


def test_an_old_scene_is_a_line_of_progress() -> None:
    scene = {"name": "flat", "source": "figure 21"}
    event = read({"kind": "scene_simulated", "trial": "p.1", "scene": scene, "set_mm": [100.0, 200.0, 300.0]})
    assert isinstance(event, TrialProgress)
    assert event.trial == "p.1"
    assert {"flat,", "3"} <= set(event.text.split())


@pytest.mark.parametrize(
    "event",
    [{"kind": "trial_finished", "trial": "p.8", "tables": []}, {"kind": "step_finished"}, {}, "text", None],
)
def test_what_is_of_today_is_left_as_it_is(event: object) -> None:
    assert upgraded(event) is event
