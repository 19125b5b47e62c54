"""A spot and why one was not found."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8] | NDArray[np.uint16]


class Failure(StrEnum):
    """Named failures of spot finding; `Finding.explain` tells cause and remedy."""

    NO_SPOT = "no_spot"
    TOO_MANY = "too_many"
    TOO_DIM = "too_dim"
    SATURATED = "saturated"
    OFF_SCANLINE = "off_scanline"
    MERGED = "merged"
    AMBIENT_CHANGED = "ambient_changed"
    AT_EDGE = "at_edge"


@dataclass(frozen=True)
class Spot:
    """A laser spot in a frame: (0, 0) is the centre of the top-left pixel, u right, v down, sd 1 sigma."""

    u_px: float
    v_px: float
    u_sd_px: float
    v_sd_px: float
    flux_dn: float
    width_px: float
    peak_dn: float
    flags: frozenset[Failure] = field(default_factory=frozenset)


@dataclass(frozen=True)
class Scanline:
    """Where spots may lie: the image line through (u0, v0) with direction (du, dv), and a half-width."""

    u0_px: float
    v0_px: float
    du: float
    dv: float
    half_width_px: float


@dataclass(frozen=True)
class Finding:
    """Spots of one capture, in order along the scanline (else by u, then v), and what went wrong."""

    spots: tuple[Spot, ...]
    failures: tuple[Failure, ...] = ()
