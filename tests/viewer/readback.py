"""What is in a recording, read with Rerun's own reader."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader

from workbench.viewer.rrd import open_rrd

ROW_ID = "rerun.controls.RowId"
TIMELINES = ("capture", "step", "time", "standoff_mm")
Row = dict[str, Any]


class Contents:
    """The rows of a recording by entity, such as `/spots/u_px/L1`."""

    def __init__(self, path: Path) -> None:
        self._rows: dict[str, list[Row]] = {}
        for chunk in open_rrd(path).stream():
            self._rows.setdefault(str(chunk.entity_path), []).extend(_rows(chunk.to_record_batch()))

    @property
    def entities(self) -> set[str]:
        return set(self._rows)

    def values(self, entity: str, component: str, timeline: str = "capture") -> list[tuple[Any, Any]]:
        """(time, values) of every row on the timeline that has the component, by time, then as logged."""
        return [(at, row[component]) for at, row in self._on(entity, component, timeline)]

    def static(self, entity: str, component: str) -> list[Any]:
        """Values of every static row that has the component, as logged; the viewer shows the last."""
        rows = sorted(self._rows[entity], key=_row_id)
        return [row[component] for row in rows if _is_static(row) and row.get(component) is not None]

    def shown(self, entity: str, component: str, timeline: str, at: Any) -> Any:
        """Values that a viewer shows with its cursor at a place of a timeline; None: nothing.

        A static value is shown everywhere; otherwise the latest one that is not cleared.
        """
        if entity not in self._rows:
            return None
        if static := self.static(entity, component):
            return static[-1]
        logged = [(time, row) for time, row in self._on(entity, component, timeline) if time <= at]
        if not logged:
            return None
        time, row = logged[-1]
        return None if self._cleared(entity, timeline, (time, row[ROW_ID]), at) else row[component]

    def positions(self, timeline: str) -> list[Any]:
        """All places of a timeline at which there is something, ascending."""
        return sorted({row[timeline] for rows in self._rows.values() for row in rows if timeline in row})

    def below(self, origin: str) -> list[str]:
        """Entities of a view: its origin, and all below."""
        return sorted(entity for entity in self._rows if f"{entity}/".startswith(f"{origin}/"))

    def everything(self) -> dict[str, list[str]]:
        """All rows, without the ids that differ from one writing to the next.

        Static rows are one row with the values that are shown: a compacted recording has no others.
        """
        return {
            entity: sorted(map(_comparable, [*_shown_static(rows), *(r for r in rows if not _is_static(r))]))
            for entity, rows in self._rows.items()
        }

    def _on(self, entity: str, component: str, timeline: str) -> list[tuple[Any, Row]]:
        rows = [row for row in self._rows[entity] if timeline in row and row.get(component) is not None]
        return [(row[timeline], row) for row in sorted(rows, key=lambda row: (row[timeline], row[ROW_ID]))]

    def _cleared(self, entity: str, timeline: str, since: tuple[Any, bytes], at: Any) -> bool:
        """Whether the entity, or one above with all below it, was cleared later."""
        for cleared in self._rows:
            if not f"{entity}/".startswith(f"{cleared}/"):
                continue
            for time, row in self._on(cleared, "Clear:is_recursive", timeline):
                takes = cleared == entity or row["Clear:is_recursive"] == [True]
                if takes and since < (time, row[ROW_ID]) and time <= at:
                    return True
        return False


@dataclass(frozen=True)
class LaidOut:
    """A view of a layout."""

    name: str
    origin: str
    kind: str
    """As Rerun names it: `2D`, `3D`, `TextDocument`, `TextLog`, `TimeSeries`, `StateTimeline`."""


def layout_views(path: Path) -> list[LaidOut]:
    """Views of the layout that was sent last."""
    return [
        LaidOut(
            row["ViewBlueprint:display_name"][0],
            f"/{row['ViewBlueprint:space_origin'][0].removeprefix('/')}",
            row["ViewBlueprint:class_identifier"][0],
        )
        for row in _last_layout(path)
        if row.get("ViewBlueprint:space_origin")
    ]


def front_tab(path: Path) -> str:
    """Name of the screen in front in the layout that was sent last."""
    rows = {row["entity"]: row for row in _last_layout(path) if "ContainerBlueprint:contents" in row}
    (root,) = (row for row in _last_layout(path) if row.get("ViewportBlueprint:root_container") is not None)
    uuid = bytes(root["ViewportBlueprint:root_container"][0]).hex()
    (tabs,) = (row for entity, row in rows.items() if entity.replace("-", "").endswith(uuid))
    (front,) = tabs["ContainerBlueprint:active_tab"]
    return str(rows[f"/{front.removeprefix('/')}"]["ContainerBlueprint:display_name"][0])


def _last_layout(path: Path) -> list[Row]:
    reader = open_rrd(path)
    layouts = [list(_layout_rows(reader, store)) for store in reader.blueprints()]
    return max(layouts, key=lambda rows: max(map(_row_id, rows)))


def _layout_rows(reader: RrdReader, store: Any) -> Iterator[Row]:
    for chunk in reader.stream(store=store):
        for row in _rows(chunk.to_record_batch()):
            yield {**row, "entity": str(chunk.entity_path)}


def _rows(batch: Any) -> list[Row]:
    """Rows with the timelines that each is on."""
    columns = {name: _column(name, batch.column(name)) for name in batch.schema.names}
    return [{name: values[i] for name, values in columns.items()} for i in range(batch.num_rows)]


def _column(name: str, column: Any) -> list[Any]:
    if not name.endswith(":blob"):
        return list(column.to_pylist())
    # One Python integer for every byte of a picture takes seconds.
    return [column[i].values.flatten().to_numpy().tobytes() for i in range(len(column))]


def _row_id(row: Row) -> bytes:
    return bytes(row[ROW_ID])


def _is_static(row: Row) -> bool:
    return not any(timeline in row for timeline in TIMELINES)


def _shown_static(rows: list[Row]) -> list[Row]:
    """One row with the latest value of each static component, if there is any."""
    shown: Row = {}
    for row in sorted(filter(_is_static, rows), key=_row_id):
        shown |= {name: value for name, value in row.items() if value is not None}
    return [shown] if shown else []


def _comparable(row: Row) -> str:
    return repr(sorted((name, value) for name, value in row.items() if name != ROW_ID and value is not None))
