"""Compiled loops before and after a fit: windows of the frames, first guesses, flags, masks."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, Image, IndexArray
from workbench.spots.kernels.columns import BACKGROUND, FLUX, LN_SU, LN_SV, U, V
from workbench.spots.kernels.compiled import compiled

_PER_HALF_HEIGHT: Final = 1.0 / (2.0 * math.pi * math.log(2.0))
_EDGE_WIDTHS: Final = 2.5
# Half-widths of windows; each suits spots of widths up to (half - 0.5) / 3: pixels beyond 3 widths have
# almost no information about the position.
HALVES_PX: Final = (5, 8, 13, 19)
_REACH_WIDTHS: Final = 3.0


@compiled
def half_for(width_px: float) -> int:
    """Half-width of the window for a spot of this width, px."""
    for half in HALVES_PX:
        if half >= _REACH_WIDTHS * width_px + 0.5:
            return half
    return HALVES_PX[-1]


@compiled
def _exclude_nearer_to_others(
    usable: BoolArray, rows: FloatArray, cols: FloatArray, group: IndexArray
) -> None:
    """Mark pixels that are closer to another peak than to the window's own as unusable."""
    half = usable.shape[1] // 2
    for i in range(len(group)):
        for k in range(len(rows)):
            dv, du = rows[k] - rows[group[i]], cols[k] - cols[group[i]]
            square = dv * dv + du * du
            if square == 0 or square > (2 * half) ** 2:
                continue
            for y in range(usable.shape[1]):
                for x in range(usable.shape[2]):
                    if 2 * ((y - half) * dv + (x - half) * du) > square:
                        usable[i, y, x] = False


@compiled
def cut_windows(
    on: Image,
    off: Image,
    share: float,
    level: float,
    clip_dn: float,
    rows: FloatArray,
    cols: FloatArray,
    group: IndexArray,
    data: FloatArray,
    usable: BoolArray,
    clip: FloatArray,
) -> None:
    """Fill data, usable pixels and clipping values, as in `Windows`, around the peaks `group` (n,)."""
    n, side = len(group), data.shape[1]
    clip[:] = math.inf
    clipped = False
    for i in range(n):
        row0, col0 = int(rows[group[i]]) - side // 2, int(cols[group[i]]) - side // 2
        for y in range(side):
            row = min(max(row0 + y, 0), on.shape[0] - 1)
            for x in range(side):
                col = min(max(col0 + x, 0), on.shape[1] - 1)
                raw = float(on[row, col])
                data[i, y, x] = raw - share * float(off[row, col]) - level
                usable[i, y, x] = col0 + x == col and row0 + y == row and raw < clip_dn
                clipped = clipped or raw >= clip_dn
    if clipped:
        for i in range(n):
            row0, col0 = int(rows[group[i]]) - side // 2, int(cols[group[i]]) - side // 2
            for y in range(side):
                row = min(max(row0 + y, 0), on.shape[0] - 1)
                for x in range(side):
                    col = min(max(col0 + x, 0), on.shape[1] - 1)
                    clip[i, y, x] = data[i, y, x] + (clip_dn - float(on[row, col]))
    _exclude_nearer_to_others(usable, rows, cols, group)


@compiled
def moment_guess(
    data: FloatArray, usable: BoolArray, rows: FloatArray, cols: FloatArray, start: FloatArray
) -> None:
    """Fill first guesses (n, 6), in pixels of the image, from windows centred on pixels (n,).

    The centre is that of mass above half the peak; the width follows from the number of pixels above it,
    which is 2 pi ln 2 width^2.
    """
    half = data.shape[1] // 2
    for i in range(len(data)):
        height = -math.inf
        for y in range(data.shape[1]):
            for x in range(data.shape[2]):
                height = max(height, data[i, y, x] if usable[i, y, x] else 0.0)
        mass = of_u = of_v = 0.0
        count = 0
        for y in range(data.shape[1]):
            for x in range(data.shape[2]):
                above = (data[i, y, x] if usable[i, y, x] else 0.0) - 0.5 * height
                if above > 0.0:
                    count += 1
                    mass, of_u, of_v = mass + above, of_u + above * x, of_v + above * y
        square = count * _PER_HALF_HEIGHT
        start[i, BACKGROUND], start[i, FLUX] = 0.0, height * (2.0 * math.pi) * (square + 0.08)
        start[i, U] = of_u / max(mass, 1e-9) + cols[i] - half
        start[i, V] = of_v / max(mass, 1e-9) + rows[i] - half
        start[i, LN_SU] = start[i, LN_SV] = 0.5 * math.log(max(square, 0.1))


@compiled
def is_near_edge(params: FloatArray, height: int, width: int) -> bool:
    """Whether the image border is within 2.5 widths of a spot (6 or more, in pixels of the image)."""
    along_u, along_v = min(params[U], width - 1 - params[U]), min(params[V], height - 1 - params[V])
    cut_off: bool = along_u < _EDGE_WIDTHS * math.exp(params[LN_SU]) or along_v < _EDGE_WIDTHS * math.exp(
        params[LN_SV]
    )
    return cut_off


@compiled
def is_clipped(on: Image, clip_dn: float, params: FloatArray) -> bool:
    """Whether a pixel within two widths of a spot (6 or more, in pixels of the image) is clipped."""
    u, v, reach_u, reach_v = params[U], params[V], 2 * math.exp(params[LN_SU]), 2 * math.exp(params[LN_SV])
    first_row, last_row = int(np.rint(v - reach_v)), int(np.rint(v + reach_v))
    first_col, last_col = int(np.rint(u - reach_u)), int(np.rint(u + reach_u))
    for y in range(max(first_row, 0), min(last_row + 1, on.shape[0])):
        for x in range(max(first_col, 0), min(last_col + 1, on.shape[1])):
            if float(on[y, x]) >= clip_dn:
                return True
    return False


@compiled
def flag_codes(on: Image, clip_dn: float, params: FloatArray, codes: IndexArray) -> None:
    """Fill (n,) codes of spots (n, 6 or more): 1 at the border, plus 2 if clipped."""
    for i in range(len(params)):
        cut_off = is_near_edge(params[i], on.shape[0], on.shape[1])
        codes[i] = int(cut_off) + 2 * int(is_clipped(on, clip_dn, params[i]))


@compiled
def halves_for(params: FloatArray, scale: float, halves: IndexArray) -> None:
    """Fill (n,) half-widths of windows for spots (n, 6), their widths multiplied by `scale`."""
    for i in range(len(params)):
        halves[i] = half_for(scale * math.exp(params[i, LN_SU]))


@compiled
def mark_discs(row0: int, col0: int, discs: FloatArray, out: BoolArray) -> None:
    """Mark pixels of a window (height, width) that lie within discs (n, 3): u, v and radius in the image.

    `row0` and `col0` are the window's first pixel in the image.
    """
    for n in range(len(discs)):
        u, v, radius = discs[n, 0] - col0, discs[n, 1] - row0, discs[n, 2]
        for y in range(max(math.floor(v - radius), 0), min(math.ceil(v + radius) + 1, out.shape[0])):
            for x in range(max(math.floor(u - radius), 0), min(math.ceil(u + radius) + 1, out.shape[1])):
                if (x - u) ** 2 + (y - v) ** 2 < radius * radius:
                    out[y, x] = True


@compiled
def mark_strip(
    row0: int, col0: int, rows: tuple[int, int], cols: tuple[int, int], mask: BoolArray, out: BoolArray
) -> None:
    """Mark pixels of a window (height, width) that lie in a strip of the image.

    `rows` and `cols` are half-open ranges; `mask` has the pixels of the strip that count, all if it is empty.
    """
    for y in range(max(rows[0] - row0, 0), min(rows[1] - row0, out.shape[0])):
        for x in range(max(cols[0] - col0, 0), min(cols[1] - col0, out.shape[1])):
            if mask.size == 0 or mask[y + row0 - rows[0], x + col0 - cols[0]]:
                out[y, x] = True


@compiled
def _spread(marks: BoolArray, reach: int, out: BoolArray) -> None:
    """Mark pixels (height, width) within `reach` of a marked one, along rows and along columns."""
    height, width = marks.shape
    along = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            if marks[y, x]:
                along[y, max(x - reach, 0) : x + reach + 1] = True
    out[:] = False
    for y in range(height):
        for near in range(max(y - reach, 0), min(y + reach + 1, height)):
            out[near] |= along[y]


@compiled
def exclude_light(
    row0: int, col0: int, lights: FloatArray, reach: int, allowed: BoolArray, usable: BoolArray
) -> None:
    """Limit a window (height, width) to pixels without the light of other spots, near where a spot may lie.

    Args:
        row0: The window's first row in the image.
        col0: Its first column.
        lights: (n, 3) u, v and radius of the other spots' light in the image.
        reach: Distance from `allowed` up to which a pixel is used, px along rows and columns.
        allowed: (height, width) pixels in a strip; those with other light are unmarked.
        usable: (height, width) pixels to use; changed.
    """
    lit, near = np.zeros(allowed.shape, np.bool_), np.empty(allowed.shape, np.bool_)
    mark_discs(row0, col0, lights, lit)
    allowed &= ~lit
    _spread(allowed, reach, near)
    usable &= near & ~lit
