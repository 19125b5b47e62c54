"""Array types by element type. Functions that use them state shapes and units in their docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
Image = NDArray[np.uint8] | NDArray[np.uint16]
"""A grey frame, (height, width)."""
