"""The line that spots may lie on, and what was found in a capture."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.spot import Failure, Spot


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
