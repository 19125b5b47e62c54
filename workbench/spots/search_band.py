"""Search band for the spots of several lasers that are on together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.spots.types import Scanline


def band(lines: Sequence[Scanline]) -> Scanline:
    """Band about the least-squares line through the ends of some scanlines that contains all of them."""
    ends = np.array([(s.u0_px + k * s.du, s.v0_px + k * s.dv) for s in lines for k in (0.0, 1.0)])
    along_u = sum(abs(s.du) for s in lines) >= sum(abs(s.dv) for s in lines)
    along, aside = ends.T if along_u else ends.T[::-1]
    slope, at_0 = np.polyfit(along, aside, 1).tolist()
    reach = float(np.abs(aside - at_0 - slope * along).max()) / np.hypot(1.0, slope)
    half_width = max(line.half_width_px for line in lines) + float(reach)
    if along_u:
        return Scanline(0.0, at_0, 1.0, slope, half_width)
    return Scanline(at_0, 0.0, slope, 1.0, half_width)
