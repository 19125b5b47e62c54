"""Mean spots of a scanning head from single observations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from workbench.calibration.data.observations import Observation, PlacementInfo, group
from workbench.calibration.scanning.fit import HeadSpots
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig


def head_spots(rig: Rig, moves: Iterable[tuple[Observation, float]]) -> tuple[HeadSpots, list[Rejected]]:
    """Average the repeats of each move of the head; reject outliers among them.

    Args:
        rig: rig with a head.
        moves: observations, each with the encoder's reading in degrees.

    Raises:
        BadInputError: the rig has no head, or observations of one placement state different standoffs.
    """
    placements: dict[str, PlacementInfo] = {}
    of_move: dict[str, tuple[str, float]] = {}
    renamed = []
    for one, reading_deg in moves:
        placements.setdefault(one.placement, PlacementInfo.of(one))
        key = f"{one.placement} at {reading_deg!r} deg"
        of_move[key] = one.placement, reading_deg
        renamed.append(replace(one, placement=key))
    cells, rejected = group(renamed, [rig.head_laser.id], rig.noise)
    seen = [of_move[cells.placements[n].key] for n in cells.placement.tolist()]
    order = list(placements)
    spots = HeadSpots(
        placements=tuple(placements.values()),
        placement=np.array([order.index(key) for key, _ in seen], np.intp),
        reading_deg=np.array([reading_deg for _, reading_deg in seen], float),
        position_px=cells.position_px,
        sd_px=cells.sd_px,
    )
    return spots, rejected
