"""Readings of a captures file: rows grouped by scene, one reading for each scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from workbench.calibration.data.averaging import outliers, scatter_chi2, weighted_mean
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.model.arrays import FloatArray
from workbench.model.captures import ALL_LASERS, CaptureRow
from workbench.model.errors import BadInputError
from workbench.ranging.ranger import Ranger, Reading, spot_arrays
from workbench.session.capture_spots import find_row_spots


def scenes(rows: Sequence[CaptureRow]) -> dict[str, list[CaptureRow]]:
    """Rows by scene, in order of appearance.

    A row with the laser `all` is a scene of its own, as is a row without a scene; other rows share the scene
    that they name. A scene without a name is named after its row.
    """
    named = {row.scene for row in rows}
    grouped: dict[str, list[CaptureRow]] = {}
    for row in rows:
        name = row.scene or f"row {row.row}"
        if not row.scene and name in named:
            name = f"{name} without a scene"
        if row.laser_id == ALL_LASERS:
            while name in grouped:
                name = f"{name} (row {row.row})"
        else:
            while name in grouped and grouped[name][0].laser_id == ALL_LASERS:
                name = f"{name} (fired alone)"
        grouped.setdefault(name, []).append(row)
    return grouped


def read_captures(ranger: Ranger, rows: Sequence[CaptureRow]) -> Iterator[Reading]:
    """One reading for each scene, in order of appearance.

    Raises:
        BadInputError: an image cannot be used, or a row names a laser that the calibration does not have.
    """
    lasers, known = (*ranger.sensor.ids, ALL_LASERS), ", ".join(ranger.sensor.ids)
    unknown = [
        f"row {row.row}, column laser_id: expected {ALL_LASERS} or one of the calibration's lasers ({known}),"
        f" got {row.laser_id}"
        for row in rows
        if row.laser_id not in lasers
    ]
    if unknown:
        raise BadInputError("\n".join(unknown))
    for scene, members in scenes(rows).items():
        if members[0].laser_id == ALL_LASERS:
            lines, lasers_on = ranger.searched(ranger.sensor.ids), len(ranger.sensor.ids)
            finding = find_row_spots(members[0], ranger.size_px, lines, lasers_on, ranger.speckle_sd_px)
            yield ranger.read_lit(scene, finding.spots)
        else:
            yield _read_alone(ranger, scene, members)


def _read_alone(ranger: Ranger, scene: str, rows: Sequence[CaptureRow]) -> Reading:
    """Reading of rows of one laser each; repeats are averaged in pixels, because range is convex in u."""
    fired = list(dict.fromkeys(row.laser_id for row in rows))
    means = {i: _mean_position(ranger, [row for row in rows if row.laser_id == i]) for i in fired}
    seen = {i: mean for i, mean in means.items() if mean is not None}
    position = np.array([mean[0] for mean in seen.values()]).reshape(-1, 2)
    sd = np.array([mean[1] for mean in seen.values()]).reshape(-1, 2)
    speckle_sd = np.array([mean[2] for mean in seen.values()]).reshape(-1, 2)
    without_spot = [i for i in fired if i not in seen]
    return ranger.read_known(
        scene, len(fired), list(seen), position, sd, without_spot=without_spot, speckle_sd_px=speckle_sd
    )


def _mean_position(
    ranger: Ranger, rows: Sequence[CaptureRow]
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """(2,) mean u, v, and their deviations by noise and by speckle; None when no row shows the laser's spot.

    As in the fit: weighted by the stated deviations, without outliers, and with the deviations scaled where
    the repeats scatter significantly more. Speckle is common to the repeats.
    """
    found = [seen for row in rows if (seen := _position(ranger, row)) is not None]
    if not found:
        return None
    spot_sd_px = ranger.calibration.laser_ranger.noise.spot_sd_px
    if len(found) == 1:  # thousands of scenes have no repeats
        position, stated, speckle_sd = found[0]
        sd = np.where(np.isfinite(stated), stated, spot_sd_px)
        return position, np.where(np.isfinite(position), sd, np.inf), speckle_sd
    position, stated, speckle_sd = np.moveaxis(np.array(found), 1, 0)
    sd = np.where(np.isfinite(stated), stated, spot_sd_px)
    kept = ~outliers(position, sd)
    scale = float(significant_scale(*scatter_chi2(position[kept], sd[kept])))
    return *weighted_mean(position[kept], scale * sd[kept]), np.sqrt((speckle_sd[kept] ** 2).mean(axis=0))


def _position(ranger: Ranger, row: CaptureRow) -> FloatArray | None:
    """(3, 2) u, v, and their deviations by noise and by speckle, of a row's only spot; None otherwise."""
    if row.on is None:
        return np.array([(row.u_px, row.v_px), (row.u_sd_px, row.v_sd_px), (np.nan, np.nan)])
    index = ranger.sensor.ids.index(row.laser_id)
    lines = ranger.scanlines[index : index + 1]
    found = find_row_spots(row, ranger.size_px, lines, 1, ranger.speckle_sd_px).spots
    spots = ranger.alone(row.laser_id, found)
    return np.stack(spot_arrays(spots))[:, 0] if len(spots) == 1 else None
