"""Parameters of a scanning head's calibration, and the predicted positions of its spots.

The vector has the sensor's parameters of a rig with the head's laser alone (lens, reference, ray), then HEAD,
then those of the placements.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import (
    PLACEMENT,
    Parameter,
    ParameterTable,
    placement_parameters,
    sensor_parameter,
    sensor_parameters,
)
from workbench.calibration.model.prediction import predict_cell
from workbench.model.head_calibration import HEAD
from workbench.model.lens import LensName
from workbench.model.rig import Rig
from workbench.optics.head import Head, turned_ray
from workbench.optics.rays import Ray
from workbench.optics.turned_laser import head_priors


class HeadLayout(NamedTuple):
    """Indices of each block of parameters."""

    lens_name: LensName

    @property
    def base(self) -> Layout:
        """Layout of the sensor's parameters without the head's, which come first."""
        return Layout(self.lens_name)

    @property
    def head(self) -> slice:
        """HEAD."""
        return slice(self.base.sensor.stop, self.base.sensor.stop + len(HEAD))

    @property
    def errors(self) -> slice:
        """PLACEMENT of every placement."""
        return slice(self.head.stop, None)


class HeadData(NamedTuple):
    """N mean positions of the head's spot."""

    placement: ArrayLike
    """(N,) index of the placement."""
    reading_rad: ArrayLike
    """(N,) reading of the encoder."""
    standoff_mm: ArrayLike
    """(N,) standoff of the placement by the ruler."""


def head_table(rig: Rig, placements: Sequence[str]) -> ParameterTable:
    """All parameters with the rig's priors.

    Raises:
        BadInputError: the rig has no head.
    """
    alone = rig.model_copy(update={"lasers": (rig.head_laser,)})
    own: tuple[Parameter, ...] = tuple(
        sensor_parameter(f"head.{name}", prior) for name, prior in head_priors(rig).items()
    )
    return ParameterTable((*sensor_parameters(alone), *own, *placement_parameters(rig, placements)))


def predict_head_spots(values: Array, lens_name: LensName, data: HeadData) -> Array:
    """(N, 2) pixel positions of the head's spots by parameters (P,)."""
    layout = HeadLayout(lens_name)
    base = layout.base
    ray = turned_ray(Ray(*values[base.ray(0)]), Head(*values[layout.head]), data.reading_rad)
    errors = values[layout.errors].reshape(-1, len(PLACEMENT))[data.placement]
    common = tuple(values[base.common])
    return jnp.stack(
        predict_cell(lens_name, (*common, *ray, *errors.T), data.standoff_mm),
        axis=1,
    )
