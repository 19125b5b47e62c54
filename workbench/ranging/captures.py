"""Ranging a captures file: rows to scenes, scenes to readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from workbench.model.captures import ALL_LASERS, CaptureRow
from workbench.model.errors import BadInputError
from workbench.ranging.ranger import Ranger, Reading
from workbench.session.capture_spots import find_row_spots


def scenes(rows: Sequence[CaptureRow]) -> dict[str, list[CaptureRow]]:
    """Rows by scene, in order of appearance.

    A row whose laser is `all` is a scene by itself, as is a row that names none; others share the scene that
    they name. A scene without a name is called by its row.
    """
    grouped: dict[str, list[CaptureRow]] = {}
    for row in rows:
        alone = not row.scene or row.laser_id == ALL_LASERS
        name = row.scene or f"row {row.row}"
        if alone and name in grouped:
            name = f"{name} (row {row.row})"
        grouped.setdefault(name, []).append(row)
    return grouped


def read_captures(ranger: Ranger, rows: Sequence[CaptureRow]) -> Iterator[Reading]:
    """One reading a scene, in order of appearance.

    Raises:
        BadInputError: an image cannot be used, or a row names a laser that the calibration does not have.
    """
    for row in rows:
        if row.laser_id not in (*ranger.sensor.ids, ALL_LASERS):
            known = ", ".join(ranger.sensor.ids)
            raise BadInputError(
                f"row {row.row}, column laser_id: expected {ALL_LASERS} or one of the calibration's"
                f" lasers ({known}), got {row.laser_id}"
            )
    for scene, members in scenes(rows).items():
        if members[0].laser_id == ALL_LASERS:
            finding = find_row_spots(members[0], ranger.size_px, ranger.scanlines, len(ranger.sensor.ids))
            yield ranger.read_lit(scene, finding.spots)
        else:
            yield _read_alone(ranger, scene, members)


def _read_alone(ranger: Ranger, scene: str, rows: Sequence[CaptureRow]) -> Reading:
    """Rows that fired one laser each; repeats of a laser are averaged in pixels, range being convex in u."""
    fired = list(dict.fromkeys(row.laser_id for row in rows))
    means = {i: _mean_position(ranger, [row for row in rows if row.laser_id == i]) for i in fired}
    seen = {i: mean for i, mean in means.items() if mean is not None}
    position = np.array([mean[0] for mean in seen.values()]).reshape(-1, 2)
    sd = np.array([mean[1] for mean in seen.values()]).reshape(-1, 2)
    return ranger.read_known(scene, len(fired), list(seen), position, sd)


def _mean_position(
    ranger: Ranger, rows: Sequence[CaptureRow]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Mean u, v and their standard deviations; None when no row shows the laser's spot."""
    found = []
    for row in rows:
        if row.on is None:
            found.append((row.u_px, row.v_px, row.u_sd_px, row.v_sd_px))
            continue
        index = ranger.sensor.ids.index(row.laser_id)
        spots = find_row_spots(row, ranger.size_px, ranger.scanlines[index : index + 1], 1).spots
        found += [(s.u_px, s.v_px, s.u_sd_px, s.v_sd_px) for s in spots if len(spots) == 1]
    if not found:
        return None
    u, v, u_sd, v_sd = np.array(found).mean(axis=0)
    shrink = len(found) ** 0.5
    return (u, v), (u_sd / shrink, v_sd / shrink)
