"""Recognition of JPEG compression in a frame, by its blocks of 8 x 8 pixels.

Each block is rounded by itself, so that neighbouring pixels of two blocks differ by more than those of one.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from workbench.model.arrays import FloatArray

BLOCK_PX: Final = 8
CHANCE_SD: Final = 6.0
"""Distance of steps between blocks from those within, in standard deviations, from which blocks are seen."""
LEAST_RATIO: Final = 1.1
"""Least ratio of these steps: fixed patterns of sensors repeat too, but with smaller ones."""
FEWEST_BLOCKS: Final = 4
"""Blocks along a side of the image from which they are looked for."""


def has_jpeg_blocks(image: np.ndarray[Any, Any]) -> bool:
    """Whether a grey image (height, width) shows the blocks of JPEG, along its rows and its columns alike.

    Compression at high quality leaves none.
    """
    if min(image.shape) < FEWEST_BLOCKS * BLOCK_PX:
        return False
    grey = image.astype(np.float32)
    return _has_steps(grey) and _has_steps(grey.T)


def _has_steps(grey: np.ndarray[Any, np.dtype[np.float32]]) -> bool:
    """Whether the steps between columns are larger at multiples of BLOCK_PX than elsewhere.

    The median over the rows' strips leaves out spots and edges.
    """
    step = np.abs(np.diff(grey, axis=1))
    # Step from column n to n + 1, less its neighbours': the structure of the scene varies slowly.
    excess = step[:, 1:-1] - (step[:, :-2] + step[:, 2:]) / 2
    mean: FloatArray = np.asarray(excess.mean(axis=0), np.float64)
    after = np.arange(2, len(mean) + 2)  # column to the right of each step
    at_border = after % BLOCK_PX == 0
    far = ~np.isin(after % BLOCK_PX, (0, 1, BLOCK_PX - 1))
    between, within = mean[at_border], mean[far]
    sd = 1.4826 * float(np.median(np.abs(within - np.median(within)))) + 1e-9
    typical = float(step.mean()) + 1e-9
    z = (float(np.median(between)) - float(np.median(within))) / (sd * 1.2533 / np.sqrt(len(between)))
    return bool(z > CHANCE_SD and np.median(between) > (LEAST_RATIO - 1) * typical)
