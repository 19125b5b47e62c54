"""What is in a recording, read with Rerun's own reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader

ROW_ID = "rerun.controls.RowId"
Row = dict[str, Any]


class Contents:
    """The rows of a recording by entity, such as `/spots/u_px/L1`."""

    def __init__(self, path: Path) -> None:
        self._rows: dict[str, list[Row]] = {}
        for chunk in RrdReader(str(path)).stream():
            self._rows.setdefault(str(chunk.entity_path), []).extend(_rows(chunk.to_record_batch()))

    @property
    def entities(self) -> set[str]:
        return set(self._rows)

    def values(self, entity: str, component: str, timeline: str = "capture") -> list[tuple[Any, Any]]:
        """(time, values) of every row that has the component, in the order of time, then of logging."""
        rows = sorted(self._rows[entity], key=lambda row: row[ROW_ID])
        found = [(row[timeline], row[component]) for row in rows if row.get(component) is not None]
        return sorted(found, key=lambda pair: pair[0])

    def everything(self) -> dict[str, list[str]]:
        """All rows, without the ids that differ from one writing to the next."""
        return {entity: sorted(_comparable(row) for row in rows) for entity, rows in self._rows.items()}


def layout_views(path: Path) -> dict[str, str]:
    """Origins of the views of the layout that was sent last, by the views' names."""
    reader = RrdReader(str(path))
    layouts = [
        [row for chunk in reader.stream(store=store) for row in _rows(chunk.to_record_batch())]
        for store in reader.blueprints()
    ]
    last = max(layouts, key=lambda rows: max(row[ROW_ID] for row in rows))
    views = [row for row in last if row.get("ViewBlueprint:space_origin")]
    return {row["ViewBlueprint:display_name"][0]: f"/{row['ViewBlueprint:space_origin'][0]}" for row in views}


def _rows(batch: Any) -> list[Row]:
    columns = {name: _column(name, batch.column(name)) for name in batch.schema.names}
    return [{name: values[i] for name, values in columns.items()} for i in range(batch.num_rows)]


def _column(name: str, column: Any) -> list[Any]:
    if not name.endswith(":blob"):
        return list(column.to_pylist())
    # One Python integer for every byte of a picture takes seconds.
    return [column[i].values.flatten().to_numpy().tobytes() for i in range(len(column))]


def _comparable(row: Row) -> str:
    return repr(sorted((name, value) for name, value in row.items() if name != ROW_ID and value is not None))
