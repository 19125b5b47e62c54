"""Readings of a captures file: rows grouped by scene, one reading for each scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, isnan, nan

import numpy as np

from workbench.calibration.data.averaging import outliers, scatter_chi2, weighted_mean
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.model.captures import ALL_LASERS, BOARD, CaptureRow
from workbench.model.errors import BadInputError
from workbench.model.number_text import counted
from workbench.ranging.alone import spots_on_line
from workbench.ranging.ranger import KnownSpots, Ranger, Reading, spot_arrays
from workbench.session.capture_spots import find_row_spots

BLOCK = 256
"""Number of scenes ranged together; with eight lasers and a fisheye they take some 20 MB."""
MeanSpot = tuple[Sequence[float], Sequence[float], Sequence[float]]
"""u, v of a spot, and their deviations by noise and by speckle; NaN where not measured or not known."""


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
    unknown: dict[str, list[int]] = {}
    for row in rows:
        if row.laser_id not in lasers:
            unknown.setdefault(row.laser_id, []).append(row.row)
    if unknown:
        expected = f"expected {ALL_LASERS} or one of the calibration's lasers ({known})"
        raise BadInputError(
            "\n".join(
                f"row {numbers[0]}{_more(numbers)}, column laser_id: {expected}, got {laser_id}"
                + ("; a view of the printed board has no range" if laser_id == BOARD else "")
                for laser_id, numbers in unknown.items()
            )
        )
    for block in _blocks(scenes(rows)):
        scene, members = next(iter(block.items()))
        if members[0].laser_id == ALL_LASERS:
            yield _read_lit(ranger, scene, members[0])
        else:
            yield from ranger.read_scenes([_known_spots(ranger, *one) for one in block.items()])


def _more(numbers: Sequence[int]) -> str:
    """Text of the rows after the first one."""
    return f" and {counted(len(numbers) - 1, 'further row')}" if len(numbers) > 1 else ""


def _blocks(grouped: Mapping[str, list[CaptureRow]]) -> Iterator[dict[str, list[CaptureRow]]]:
    """Consecutive scenes to range together, `BLOCK` at most; one with images is alone, as it takes long."""
    block: dict[str, list[CaptureRow]] = {}
    for scene, rows in grouped.items():
        has_images = any(row.on is not None for row in rows)
        if block and (has_images or len(block) == BLOCK):
            yield block
            block = {}
        block[scene] = rows
        if has_images:
            yield block
            block = {}
    if block:
        yield block


def _read_lit(ranger: Ranger, scene: str, row: CaptureRow) -> Reading:
    lines, lasers_on = ranger.searched(ranger.sensor.ids), len(ranger.sensor.ids)
    finding = find_row_spots(row, ranger.size_px, lines, lasers_on, ranger.speckle_sd_px)
    return ranger.read_lit(scene, finding.spots)


def _known_spots(ranger: Ranger, scene: str, rows: Sequence[CaptureRow]) -> KnownSpots:
    """Spots of rows of one laser each; repeats are averaged in pixels, because range is convex in u."""
    by_laser: dict[str, list[CaptureRow]] = {}
    for row in rows:
        by_laser.setdefault(row.laser_id, []).append(row)
    means = {i: _mean_spot(ranger, own) for i, own in by_laser.items()}
    seen = {i: mean for i, mean in means.items() if mean is not None}
    position, sd, speckle_sd = np.array([*seen.values()], float).reshape(-1, 3, 2).swapaxes(0, 1)
    without_spot = [i for i in by_laser if i not in seen]
    return KnownSpots(scene, len(by_laser), [*seen], position, sd, speckle_sd, without_spot=without_spot)


def _mean_spot(ranger: Ranger, rows: Sequence[CaptureRow]) -> MeanSpot | None:
    """Mean u, v, and their deviations by noise and by speckle; None when no row shows the laser's spot.

    As in the fit: weighted by the stated deviations, without outliers, and with the deviations scaled where
    the repeats scatter significantly more. Speckle is common to the repeats.
    """
    found = [seen for row in rows if (seen := _spot(ranger, row)) is not None]
    if not found:
        return None
    spot_sd_px = ranger.calibration.laser_ranger.noise.spot_sd_px
    if len(found) == 1:  # thousands of scenes have no repeats
        ((position, stated, speckle_sd),) = found
        sds = [spot_sd_px if isnan(sd) else sd for sd in stated]
        return position, [inf if isnan(p) else sd for p, sd in zip(position, sds, strict=True)], speckle_sd
    position_px, stated_px, speckle_px = np.array(found, float).swapaxes(0, 1)
    sd_px = np.where(np.isfinite(stated_px), stated_px, spot_sd_px)
    kept = ~outliers(position_px, sd_px)
    scale = float(significant_scale(*scatter_chi2(position_px[kept], sd_px[kept])))
    mean, mean_sd = weighted_mean(position_px[kept], scale * sd_px[kept])
    return mean.tolist(), mean_sd.tolist(), np.sqrt((speckle_px[kept] ** 2).mean(axis=0)).tolist()


def _spot(ranger: Ranger, row: CaptureRow) -> MeanSpot | None:
    """u, v, and their deviations by noise and by speckle, of a row's only spot; None otherwise."""
    if row.on is None:
        return (row.u_px, row.v_px), (row.u_sd_px, row.v_sd_px), (nan, nan)
    index = ranger.sensor.ids.index(row.laser_id)
    lines = ranger.scanlines[index : index + 1]
    found = find_row_spots(row, ranger.size_px, lines, 1, ranger.speckle_sd_px).spots
    (spots,) = spots_on_line(ranger.sensor, [(row.laser_id, found)])
    if len(spots) != 1:
        return None
    position, sd, speckle_sd = (part[0].tolist() for part in spot_arrays(spots))
    return position, sd, speckle_sd
