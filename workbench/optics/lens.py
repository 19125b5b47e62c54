"""A lens model: what every kind of lens has to state of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike
from numpy.typing import NDArray

from workbench.model.lens import COEFFICIENTS, PINHOLE, LensName, lens_parameters

EitherArray = Array | NDArray[Any]
"""JAX's, or numpy's where all inputs are numpy's arrays."""
Numbers = Sequence[ArrayLike] | EitherArray
"""A vector of parameters; each may itself be an array, and all broadcast against each other."""
Distort = Callable[[Numbers, EitherArray, EitherArray], tuple[EitherArray, EitherArray]]
RadialSlope = Callable[[Numbers, EitherArray, EitherArray], EitherArray]


@dataclass(frozen=True, eq=False)
class LensModel:
    """A kind of lens: its parameters and its projection. There is one object of each kind.

    A lens of this kind is a vector of numbers in the order of `parameters`: f, cx, cy in pixels (square
    pixels), then the distortion coefficients, which have no unit and are all 0 for the undistorted lens.
    """

    name: LensName
    """In rig files, and ROS's `distortion_model`."""
    distort: Distort
    """Distorted normalised coordinates by coefficients and undistorted x = X/Z, y = Y/Z; shapes broadcast."""
    radial_slope: RadialSlope
    """Derivative of the distorted radius by the undistorted, likewise. Up to the radius where it is no longer
    positive, each direction has an image point of its own; beyond, the model folds over."""
    trial_sd: Mapping[str, float]
    """Prior standard deviation (1 sigma) of each coefficient that a rig file holds constant, where a fit
    tests whether the data need it."""
    terms: tuple[str, ...]
    """Terms that may be absent, the first to go first; a term of several coefficients has spaces between."""
    polynomial_degree: int | None = None
    """Degree of the distorted coordinates as polynomials in undistorted ones that move along a straight line;
    None if they are no polynomials."""

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the distortion coefficients, in the order of OpenCV and ROS."""
        return COEFFICIENTS[self.name]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, in the order of every vector of them."""
        return lens_parameters(self.name)

    def project(self, lens: Numbers, x: ArrayLike, y: ArrayLike) -> tuple[EitherArray, EitherArray]:
        """Pixel position (u, v) of the undistorted normalised coordinates x = X/Z, y = Y/Z."""
        f_px, cx_px, cy_px = (as_array(lens[i]) for i in range(len(PINHOLE)))
        x_distorted, y_distorted = self.distort(lens[len(PINHOLE) :], as_array(x), as_array(y))
        return cx_px + f_px * x_distorted, cy_px + f_px * y_distorted

    def is_unfolded(self, lens: Numbers, x: ArrayLike, y: ArrayLike) -> EitherArray:
        """Whether the model has not folded over at (x, y)."""
        return self.radial_slope(lens[len(PINHOLE) :], as_array(x), as_array(y)) > 0


def as_array(x: ArrayLike) -> EitherArray:
    """A JAX array, except that numpy's stay: the same maths then runs on complex numbers uncompiled."""
    return x if isinstance(x, np.ndarray) else jnp.asarray(x)
