"""Observations from a recording: the spots of every capture as the session found them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import fields
from math import isnan
from pathlib import Path
from typing import Any

from workbench.calibration.data.boards import BoardView, on_boards, see_board
from workbench.calibration.data.observations import Observation, PlacementInfo
from workbench.calibration.data.spot_rows import observe
from workbench.model.captures import BOARD
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig
from workbench.model.spot import Failure, Spot
from workbench.spots import Finding
from workbench.viewer import entities as at
from workbench.viewer.frame import RECORDED, as_png
from workbench.viewer.rrd import open_rrd

BLOB = "EncodedDepthImage:blob"
OPTIONAL = {field.name for field in fields(Spot) if field.default is None}
"""Quantities of a spot that need not be known."""
Row = dict[str, Any]


def observations_of_recording(
    path: Path, rig: Rig
) -> tuple[list[Observation], list[Rejected], list[BoardView]]:
    """Observations, rejected captures and views of the board, as a fit of the session uses them.

    Args:
        path: recording of a session, complete or not.
        rig: rig of the session.

    Raises:
        BadInputError: the file is no recording of the workbench, or a laser is not of this rig.
    """
    try:
        captures, spots, frames = _rows(path)
    except (RuntimeError, OSError) as error:
        raise BadInputError(f"{path}: expected a recording of the workbench: {error}") from None
    if not captures:
        raise BadInputError(f"{path}: expected a recording of a calibration, it has no captures")
    boards = _boards(captures, frames, rig)
    zero_ns = min(row.get("clock_ns", 0) for row in captures.values())
    found = [
        _observation(row, spots.get(number, {}), rig, path, zero_ns)
        for number, row in sorted(captures.items())
        if row["purpose"] == "calibration" and row["laser_id"] != BOARD
    ]
    seen = on_boards(rig.board, boards, found)
    return (
        [one for one in seen if isinstance(one, Observation)],
        [one for one in (*seen, *boards.values()) if isinstance(one, Rejected)],
        [one for one in boards.values() if isinstance(one, BoardView)],
    )


def _rows(path: Path) -> tuple[dict[int, Row], dict[int, Row], dict[int, bytes]]:
    """Records of the captures, records of their spots, and frames of the board, by number of capture."""
    captures: dict[int, Row] = {}
    spots: dict[int, Row] = {}
    blobs: dict[int, bytes] = {}
    for chunk in open_rrd(path).stream():
        entity = str(chunk.entity_path).removeprefix("/")
        if entity not in {at.CAPTURE_RECORD, at.SPOTS_RECORD, at.IMAGE}:
            continue
        batch = chunk.to_record_batch()
        numbers = batch.column(at.CAPTURE).to_pylist()
        if entity == at.IMAGE:
            column = batch.column(BLOB)
            blobs |= {n: column[i].values.flatten().to_numpy().tobytes() for i, n in enumerate(numbers)}
            continue
        table = {name: batch.column(name).to_pylist() for name in batch.schema.names}
        kept = captures if entity == at.CAPTURE_RECORD else spots
        for i, number in enumerate(numbers):
            row = {name: values[i] for name, values in table.items()}
            kept[number] = (
                {n: v[0] for n, v in row.items() if isinstance(v, list) and v} if kept is captures else row
            )
    return (
        captures,
        spots,
        {n: blob for n, blob in blobs.items() if captures.get(n, {}).get("laser_id") == BOARD},
    )


def _observation(row: Row, spots: Row, rig: Rig, path: Path, zero_ns: int) -> Observation | Rejected:
    if row["laser_id"] not in rig.laser_ids:
        raise BadInputError(f"{path}: expected lasers {', '.join(rig.laser_ids)}, got {row['laser_id']}")
    observation = Observation(
        source=row["source"],
        laser_id=row["laser_id"],
        placement=row["placement"],
        standoff_mm=row["nominal_mm"],
        repeat=row["repeat"],
        u_px=float("nan"),
        v_px=float("nan"),
        standoff_sd_mm=row["nominal_sd_mm"],
        time_s=(row["clock_ns"] - zero_ns) / 1e9 if "clock_ns" in row else float("nan"),
        part=row.get("part", ""),
    )
    count = len(spots.get("u_px") or ())
    found = tuple(
        Spot(
            **{name: _number(spots, name, n) for name in RECORDED},
            flags=frozenset(Failure(flag) for flag in spots["flags"][n].split()),
        )
        for n in range(count)
    )
    return observe(Finding(found), rig.lasers[rig.laser_ids.index(row["laser_id"])], observation)


def _number(spots: Row, name: str, n: int) -> Any:
    """Quantity of one spot; None where a recording of an earlier release, or its frame, does not have it."""
    values = spots.get(name)
    return None if values is None or (name in OPTIONAL and isnan(values[n])) else values[n]


def _boards(captures: dict[int, Row], frames: dict[int, bytes], rig: Rig) -> dict[str, BoardView | Rejected]:
    """Views of the board by placement, each from the mean of its frames."""
    placed: dict[str, list[int]] = defaultdict(list)
    for number, row in sorted(captures.items()):
        if row["laser_id"] == BOARD:
            placed[row["placement"]].append(number)
    found: dict[str, BoardView | Rejected] = {}
    for key, numbers in placed.items():
        first = captures[numbers[0]]
        info = PlacementInfo(key, first["nominal_mm"], first["nominal_sd_mm"], 0.0, first["source"])
        found[key] = see_board([as_png(frames[n])[1] for n in numbers], rig.board, info)
    return found
