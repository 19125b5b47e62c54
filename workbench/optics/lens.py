"""Lens models: parameters, projection and valid domain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike
from numpy.typing import NDArray

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.lens import COEFFICIENTS, PINHOLE, LensName, lens_parameters

EitherArray = Array | NDArray[Any]
"""A JAX array, or a numpy array where all inputs are numpy arrays."""
Numbers = Sequence[ArrayLike] | EitherArray
"""A vector of parameters; each may itself be an array, and all broadcast against each other."""
Distort = Callable[[Numbers, EitherArray, EitherArray], tuple[EitherArray, EitherArray]]
RadiusOfVariable = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class LensModel:
    """Lens model; there is one object of each.

    A lens is a vector in the order of `parameters`: f, cx, cy in pixels (square pixels), then the distortion
    coefficients. These have no unit, and are all 0 for the undistorted lens.
    """

    name: LensName
    """Name in rig files, and ROS's `distortion_model`."""
    distort: Distort
    """Distorted normalised coordinates by coefficients and undistorted x = X/Z, y = Y/Z; shapes broadcast."""
    radial_terms: tuple[str, ...]
    """Coefficients k1, k2, ... of the distorted radius q (1 + k1 q^2 + k2 q^4 + ...), in rising order."""
    undistorted_radius: RadiusOfVariable
    """Undistorted radius r = hypot(x, y) of the variable q >= 0 of that polynomial; infinite where no
    direction has this q. It increases with q."""
    trial_sd: Mapping[str, float]
    """Prior sd (1 sigma) with which a fit tests coefficients that the rig file holds constant."""
    terms: tuple[str, ...]
    """Terms that may be absent, the highest order first; spaces separate coefficients of one term."""
    polynomial_degree: int | None = None
    """Degree of the distorted coordinates as polynomials along a straight line of undistorted ones; None if
    they are not polynomials."""

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the distortion coefficients, in the order of OpenCV and ROS."""
        return COEFFICIENTS[self.name]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, in the order of a lens vector."""
        return lens_parameters(self.name)

    def project(self, lens: Numbers, x: ArrayLike, y: ArrayLike) -> tuple[EitherArray, EitherArray]:
        """Pixel position (u, v) of the undistorted normalised coordinates x = X/Z, y = Y/Z."""
        f_px, cx_px, cy_px = (as_array(lens[i]) for i in range(len(PINHOLE)))
        x_distorted, y_distorted = self.distort(lens[len(PINHOLE) :], as_array(x), as_array(y))
        return cx_px + f_px * x_distorted, cy_px + f_px * y_distorted

    def unfolded_radius(self, coefficients: Numbers) -> FloatArray:
        """Undistorted radius of the fold, up to which the projection is one-to-one; infinity without fold.

        Beyond it the distorted radius decreases, and where it increases again further out image points occur
        twice. Tangential terms are neglected. The zeros of the slope 1 + 3 k1 q^2 + 5 k2 q^4 + ... are the
        inverse eigenvalues of the companion matrix of the polynomial in 1 / q^2.

        Args:
            coefficients: (C, ...) distortion coefficients, in the model's order.

        Returns:
            (...) radius r = hypot(x, y), without unit.
        """
        place = [self.coefficients.index(name) for name in self.radial_terms]
        terms = np.stack(np.broadcast_arrays(*(np.asarray(coefficients[n], float) for n in place)), axis=-1)
        count = len(place)
        companion = np.zeros((*terms.shape[:-1], count, count))
        companion[..., 0, :] = -terms * (2.0 * np.arange(1, count + 1) + 1.0)
        companion[..., range(1, count), range(count - 1)] = 1.0
        inverse = np.linalg.eigvals(companion)
        largest = np.where(inverse.imag == 0, inverse.real, 0.0).max(axis=-1)
        with np.errstate(divide="ignore"):
            return self.undistorted_radius(1.0 / np.sqrt(np.maximum(largest, 0.0)))

    def is_unfolded(self, lens: Numbers, x: ArrayLike, y: ArrayLike) -> BoolArray:
        """Whether (x, y) lies within the radius of the fold; shapes broadcast."""
        radius = np.hypot(np.asarray(x, float), np.asarray(y, float))
        return np.asarray(radius < self.unfolded_radius(lens[len(PINHOLE) :]))


def as_array(x: ArrayLike) -> EitherArray:
    """A JAX array, or the numpy array unchanged: it may be complex, for complex-step derivatives."""
    return x if isinstance(x, np.ndarray) else jnp.asarray(x)
