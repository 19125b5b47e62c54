"""The run of the thesis's simulation: files and tables of claims."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.running import running
from tests.support.thesis_scenes import scene
from workbench.model.errors import StoppedError
from workbench.model.event import TrialFinished, TrialProgress
from workbench.model.rig import load_rig
from workbench.trials.thesis.schema import ClaimRow
from workbench.trials.thesis.trial import claim_tables, run_trial

RIG = load_rig(Path(__file__).parents[4] / "rigs/thesis-simulated.yaml")


def row(quantity: str, **changes: object) -> ClaimRow:
    values: dict[str, object] = {
        "scene": "a", "source": "s", "quantity": quantity, "nearest_mm": 100.0, "farthest_mm": 500.0,
        "stated": 0.05, "thesis": 0.04, "ours": 0.01, "noisy": 0.02, "reproduced": True, "better": True,
    }  # fmt: skip
    return ClaimRow.model_validate(values | changes)


def test_each_quantity_is_a_table_of_its_unit() -> None:
    tables = claim_tables("p.1", [row("shape", stated=500.0), row("range"), row("range"), row("readings")])
    assert [(table.name, len(table.rows)) for table in tables] == [
        ("p.1-claims-range", 2),
        ("p.1-claims-shape", 1),
        ("p.1-claims-readings", 1),
    ]
    units = {table.name: {c.key: c.unit for c in table.columns} for table in tables}
    assert units["p.1-claims-range"]["ours"] == "%"
    assert units["p.1-claims-shape"]["ours_mm"] == "mm"
    assert units["p.1-claims-readings"]["ours"] == ""
    ours = [column.key for column in tables[0].columns].index("ours")
    assert tables[0].text(0, ours) == "1.00", "shown in percent"
    assert tables[0].rows[0][ours] == 0.01


def test_only_a_claim_that_is_not_kept_is_marked() -> None:
    judged = ((True, True), (None, True), (False, False))
    (table,) = claim_tables("p.1", [row("range", reproduced=kept, better=ours) for kept, ours in judged])
    keys = [column.key for column in table.columns]
    marks = [(one[keys.index("not_reproduced")], one[keys.index("not_better")]) for one in table.rows]
    assert marks == [(False, False), (False, False), (True, True)]


def test_scenes_are_simulated_at_their_own_number_of_distances(tmp_path: Path) -> None:
    scenes = [scene(name="a"), scene(name="b", points=3, claims=[{"quantity": "range", "stated": 0.5}])]
    with running(tmp_path) as session:
        session.context.rig = RIG
        assert "1 of 1 claims" in run_trial(session.context, "p.1", scenes, 2)
        folder = session.context.session_dir
        readings, claims = (pd.read_csv(folder / f"p.1{end}.csv") for end in ("-readings", ""))
        events = session.events
    assert readings["scene"].value_counts().to_dict() == {"b": 3, "a": 2}
    assert claims["scene"].tolist() == ["a", "b"]
    assert sum(isinstance(event, TrialProgress) for event in events) == 2
    assert isinstance(events[-1], TrialFinished)
    assert (folder / f"{events[-1].tables[0].name}.csv").is_file()


def test_a_stop_comes_between_two_scenes(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        session.context.rig = RIG
        session.stop.append("enough")
        with pytest.raises(StoppedError):
            run_trial(session.context, "p.1", [scene()], 2)
        assert session.events == []
