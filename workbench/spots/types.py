"""Scanline that spots may lie on, and result of a search."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.spot import Failure, Spot


@dataclass(frozen=True, slots=True)
class Scanline:
    """Image line that spots may lie on: through (u0, v0) with direction (du, dv), and a half-width."""

    u0_px: float
    v0_px: float
    du: float
    dv: float
    half_width_px: float


@dataclass(frozen=True, slots=True)
class Finding:
    """Spots of one capture, in order along the first scanline (else by u, then v), and its failures."""

    spots: tuple[Spot, ...]
    failures: tuple[Failure, ...] = ()
