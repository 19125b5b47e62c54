"""Laser of a scanning head at a reading of the encoder, by the priors of the rig file."""

from __future__ import annotations

from math import radians

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.model.head_calibration import HEAD
from workbench.model.prior import Prior
from workbench.model.rig import LaserSpec, Rig
from workbench.optics.head import Head, turned_ray
from workbench.optics.rays import RAY, Ray


def head_priors(rig: Rig) -> dict[str, Prior]:
    """Priors of the head's parameters by name, in the order of `HEAD`.

    Raises:
        BadInputError: the rig has no head.
    """
    head = rig.scanning_head
    eccentricity = Prior(value=0.0, sd=radians(head.eccentricity_sd_deg))
    return {name: eccentricity if name.startswith("eccentricity") else getattr(head, name) for name in HEAD}


def turned_laser(rig: Rig, reading_deg: float) -> LaserSpec:
    """The head's laser with the ray at a reading, and its standard deviations to first order.

    The noise of the reading is included.

    Raises:
        BadInputError: the rig has no head.
    """
    laser = rig.head_laser
    reading = Prior(value=radians(reading_deg), sd=radians(rig.scanning_head.reading_sd_deg))
    priors = [*(getattr(laser, name) for name in RAY), *head_priors(rig).values(), reading]
    ray, by_parameter = _linearised(np.array([prior.value for prior in priors]))
    sd = np.linalg.norm(np.asarray(by_parameter) * [prior.sd for prior in priors], axis=1)
    turned = zip(RAY, np.asarray(ray).tolist(), sd.tolist(), strict=True)
    return laser.model_copy(
        update={name: Prior.model_construct(value=value, sd=own_sd) for name, value, own_sd in turned}
    )


@jax.jit
def _linearised(values: Array) -> tuple[Array, Array]:
    """Ray (4,) of the parameters RAY, HEAD and reading (P,), and its derivatives (4, P)."""

    def ray(values: Array) -> Array:
        head = slice(len(RAY), len(RAY) + len(HEAD))
        return jnp.stack(
            [jnp.asarray(part) for part in turned_ray(Ray(*values[:4]), Head(*values[head]), values[-1])]
        )

    return ray(values), jax.jacfwd(ray)(values)
