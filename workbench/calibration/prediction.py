"""Where a spot of a calibration is expected: the one prediction that every fit shares."""

from __future__ import annotations

from jax import Array
from jax.typing import ArrayLike

from workbench.calibration.parameters import LENS, RAY, REFERENCE
from workbench.optics.lens import Lens
from workbench.optics.rays import Plane, Ray, spot_on_plane

_LENS = slice(0, len(LENS))
_REFERENCE = slice(_LENS.stop, _LENS.stop + len(REFERENCE))
_RAY = slice(_REFERENCE.stop, _REFERENCE.stop + len(RAY))


def predict_cell(inputs: tuple[ArrayLike, ...], standoff_mm: ArrayLike) -> tuple[Array, Array]:
    """Pixel position (u, v) of one laser on the target of one placement; shapes broadcast.

    Args:
        inputs: the 17 numbers that it depends on: LENS, REFERENCE, RAY of the laser, PLACEMENT.
        standoff_mm: of the placement, by the ruler.
    """
    offset_mm, ruler_scale = inputs[_REFERENCE]
    error_mm, slope_x, slope_y = inputs[_RAY.stop :]
    z0_mm = standoff_mm * (1.0 + ruler_scale) + error_mm + offset_mm
    return spot_on_plane(Lens(*inputs[_LENS]), Ray(*inputs[_RAY]), Plane(z0_mm, slope_x, slope_y))
