"""Search band for the spots of a whole line of lasers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.model.rig import ImageAxis
from workbench.spots import Scanline


def band(lines: Sequence[Scanline], axis: ImageAxis) -> Scanline:
    """Band about the least-squares line through the ends of some scanlines that contains all of them."""
    ends = np.array([(s.u0_px + k * s.du, s.v0_px + k * s.dv) for s in lines for k in (0.0, 1.0)])
    along, aside = (ends[:, 0], ends[:, 1]) if axis == "u" else (ends[:, 1], ends[:, 0])
    slope, at_0 = np.polyfit(along, aside, 1).tolist()
    reach = float(np.abs(aside - at_0 - slope * along).max()) / np.hypot(1.0, slope)
    half_width = max(line.half_width_px for line in lines) + float(reach)
    if axis == "u":
        return Scanline(0.0, at_0, 1.0, slope, half_width)
    return Scanline(at_0, 0.0, slope, 1.0, half_width)
