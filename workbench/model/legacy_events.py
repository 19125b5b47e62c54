"""Conversion of events that version 0.1.0 recorded to the present schema.

Version 0.1.0 had one event for each trial: `trial_finished` with the rows of the accuracy trial, and
`scene_simulated` and `simulation_finished` of the thesis's simulation. Their numbers become tables; the
curves of single scenes remain in the session's CSV files.
"""

from __future__ import annotations

from typing import Any

UNITS = ("mm", "px", "deg")


def upgraded(event: Any) -> Any:
    """Event with the present keys; anything but a trial's event of version 0.1.0 is returned unchanged."""
    if not isinstance(event, dict):
        return event
    kind, trial = event.get("kind"), event.get("trial")
    if kind == "trial_finished" and "rows" in event:
        return _finished(trial, "Accuracy (error = measured - true)", event["rows"])
    if kind == "simulation_finished":
        return _finished(trial, "The thesis's simulation", [_claim(row) for row in event["rows"]])
    if kind == "scene_simulated":
        scene = event["scene"]
        text = f"{scene['name']}, {scene['source']}: {len(event['set_mm'])} distances"
        return {"kind": "trial_progress", "trial": trial, "text": text}
    return event


def _claim(row: dict[str, Any]) -> dict[str, Any]:
    """Row of a claim with its flags inverted to alarms: true where the claim does not hold."""
    kept = {key: value for key, value in row.items() if key not in {"reproduced", "better"}}
    return kept | {"not_reproduced": row["reproduced"] is False, "not_better": not row["better"]}


def _finished(trial: Any, title: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    keys = list(dict.fromkeys(key for row in rows for key in row))
    table = {
        "name": trial,
        "title": title,
        "columns": [_column(key) for key in keys],
        "rows": [[row.get(key) for key in keys] for row in rows],
    }
    return {"kind": "trial_finished", "trial": trial, "tables": [table]}


def _column(key: str) -> dict[str, str]:
    name, _, unit = key.rpartition("_")
    if unit not in UNITS:
        name, unit = key, ""
    form = ".2f" if unit == "mm" and name != "standoff" else ""
    return {"key": key, "name": name.replace("_", " "), "unit": unit, "format": form}
