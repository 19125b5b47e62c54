"""What is in a recording, read with Rerun's own reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader


class Contents:
    """The rows of a recording, by entity."""

    def __init__(self, path: Path) -> None:
        self._rows: dict[str, list[dict[str, Any]]] = {}
        for chunk in RrdReader(str(path)).stream():
            rows = chunk.to_record_batch().to_pylist()
            self._rows.setdefault(str(chunk.entity_path), []).extend(rows)

    @property
    def entities(self) -> set[str]:
        return set(self._rows)

    def values(self, entity: str, component: str, timeline: str = "capture") -> list[tuple[Any, Any]]:
        """(time, values) of every row that has the component, in the order of the timeline, then of logging."""
        found = [
            (row[timeline], row[component])
            for row in sorted(self._rows[entity], key=_row_id)
            if row.get(component) is not None
        ]
        return sorted(found, key=lambda row: row[0])

    def everything(self) -> dict[str, list[str]]:
        """All rows without the ids that differ from one writing to the next."""
        return {entity: sorted(_comparable(row) for row in rows) for entity, rows in self._rows.items()}


def _row_id(row: dict[str, Any]) -> Any:
    return row["rerun.controls.RowId"]


def _comparable(row: dict[str, Any]) -> str:
    known = {key: value for key, value in row.items() if key != "rerun.controls.RowId" and value is not None}
    return repr(sorted(known.items()))
