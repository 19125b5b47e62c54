"""Quality of the captures of one laser at one placement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.model.limit import Limit
from workbench.model.spot import Failure, Spot
from workbench.model.yamlfile import FileModel


class CaptureLimits(FileModel):
    """Limits on `Quality`, of the captures of one laser at one placement."""

    missing: Limit | None = None
    saturated: Limit | None = None
    snr: Limit | None = None
    scatter_px: Limit | None = None


@dataclass(frozen=True)
class Quality:
    """Quality of the repeats of one laser at one placement; quantities of spots are None without a spot."""

    repeats: int
    missing: float
    """Share of the repeats with no spot or more than one."""
    saturated: float
    """Share of the spots with clipped pixels."""
    snr: float | None = None
    """Signal-to-noise ratio: median of spot width / stated sd of the centre. With shot noise alone this is
    the square root of the number of electrons."""
    scatter_px: float | None = None
    """Standard deviation of the centre over the repeats, larger of both axes; None below two spots."""
    u_px: float | None = None
    """Mean u of the centres."""
    v_px: float | None = None
    """Mean v of the centres."""


def quality_of(found: Sequence[Sequence[Spot]]) -> Quality:
    """Quality of repeats from the spots found in each of them."""
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
