"""A spot, the line it may lie on, and why one was not found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Failure(StrEnum):
    """What went wrong with a capture, or with one of its spots; `explain` tells cause and remedy."""

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
    flags: frozenset[Failure] = NO_FLAGS


@dataclass(frozen=True, slots=True)
class Scanline:
    """Where spots may lie: the image line through (u0, v0) with direction (du, dv), and a half-width."""

    u0_px: float
    v0_px: float
    du: float
    dv: float
    half_width_px: float


@dataclass(frozen=True, slots=True)
class Finding:
    """Spots of one capture, in order along the first scanline (else by u, then v), and what went wrong."""

    spots: tuple[Spot, ...]
    failures: tuple[Failure, ...] = ()
