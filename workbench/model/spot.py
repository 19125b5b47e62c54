"""A laser spot in a frame: what the search finds, the journal keeps, and the recording shows."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from pydantic import PlainSerializer


class Failure(StrEnum):
    """What went wrong with a capture, or with one of its spots; `spots.explain` has cause and remedy."""

    NO_SPOT = "no_spot"
    TOO_FEW = "too_few"
    TOO_MANY = "too_many"
    TOO_DIM = "too_dim"
    SATURATED = "saturated"
    OFF_SCANLINE = "off_scanline"
    MERGED = "merged"
    AMBIENT_CHANGED = "ambient_changed"
    AT_EDGE = "at_edge"


NO_FLAGS: frozenset[Failure] = frozenset()
Flags = Annotated[frozenset[Failure], PlainSerializer(sorted, return_type=list[str])]
"""In JSON in alphabetical order, so that the same spot is the same text."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A laser spot in a frame: (0, 0) is the centre of the top-left pixel, u right, v down, sd 1 sigma."""

    u_px: float
    v_px: float
    u_sd_px: float
    v_sd_px: float
    flux_dn: float
    """Sum over the whole spot, above the background."""
    width_px: float
    """Standard deviation of the profile before the pixel integrates it, geometric mean of both axes."""
    peak_dn: float
    """Highest pixel of the fitted profile above the background, also where the pixel itself was clipped."""
    flags: Flags = NO_FLAGS
    laser_id: str | None = None
    """None while no laser has been assigned."""
