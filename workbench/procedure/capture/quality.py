"""How good the captures of one laser at one placement are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.model.limit import Limit
from workbench.model.spot import Failure, Spot
from workbench.model.yamlfile import FileModel


class CaptureLimits(FileModel):
    """Limits on the captures of one laser at one placement; of the quantities of `Quality`."""

    missing: Limit | None = None
    saturated: Limit | None = None
    snr: Limit | None = None
    scatter_px: Limit | None = None


@dataclass(frozen=True)
class Quality:
    """Of the repeats of one laser at one placement; numbers of spots are None where there is none."""

    repeats: int
    missing: float
    """Share of the repeats without just one spot."""
    saturated: float
    """Share of the spots with clipped pixels."""
    snr: float | None = None
    """Median of the spot's width over its centre's stated deviation: with shot noise alone that is the square
    root of its electrons, its signal to noise."""
    scatter_px: float | None = None
    """Standard deviation of the centre over the repeats, of the worse axis; None with fewer than two."""
    u_px: float | None = None
    """Mean."""
    v_px: float | None = None


def quality_of(found: Sequence[Sequence[Spot]]) -> Quality:
    """Quality from the spots of each repeat."""
    spots = [one[0] for one in found if len(one) == 1]
    missing = 1 - len(spots) / len(found)
    if not spots:
        return Quality(len(found), missing, 0.0)
    centres = np.array([(spot.u_px, spot.v_px) for spot in spots])
    u_px, v_px = centres.mean(axis=0)
    return Quality(
        repeats=len(found),
        missing=missing,
        saturated=float(np.mean([Failure.SATURATED in spot.flags for spot in spots])),
        snr=float(np.median([spot.width_px / spot.u_sd_px for spot in spots])),
        scatter_px=float(centres.std(axis=0, ddof=1).max()) if len(spots) > 1 else None,
        u_px=float(u_px),
        v_px=float(v_px),
    )
