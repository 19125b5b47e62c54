"""Laser spot in a frame: result of the search, entry of the journal, item of the recording."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from pydantic import PlainSerializer


class Failure(StrEnum):
    """Failure of a capture or of one of its spots; `spots.explain` states causes and remedies."""

    NO_SPOT = "no_spot"
    TOO_FEW = "too_few"
    TOO_MANY = "too_many"
    TOO_DIM = "too_dim"
    SATURATED = "saturated"
    BLOOMING = "blooming"
    OFF_SCANLINE = "off_scanline"
    MERGED = "merged"
    AMBIENT_CHANGED = "ambient_changed"
    AT_EDGE = "at_edge"
    ON_OFF_EXCHANGED = "on_off_exchanged"


NO_FLAGS: frozenset[Failure] = frozenset()
Flags = Annotated[frozenset[Failure], PlainSerializer(sorted, return_type=list[str])]
"""Flags of a spot; in JSON in alphabetical order, so that equal spots have equal text."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Laser spot in a frame: (0, 0) is the centre of the top-left pixel, u right, v down, sd 1 sigma.

    `u_sd_px` and `v_sd_px` are by noise, which differs between captures. Speckle is frozen while the target
    stands still: it is common to all captures of a placement.
    """

    u_px: float
    v_px: float
    u_sd_px: float
    v_sd_px: float
    flux_dn: float
    """Sum of the fitted profile above the background."""
    width_px: float
    """Standard deviation of the profile before pixel integration, geometric mean of both axes."""
    peak_dn: float
    """Highest pixel of the fitted profile above the background, even if the measured pixel is clipped."""
    flags: Flags = NO_FLAGS
    laser_id: str | None = None
    """Laser that the spot is assigned to; None: not assigned."""
    u_speckle_sd_px: float | None = None
    """1 sigma by speckle; None: not known."""
    v_speckle_sd_px: float | None = None
