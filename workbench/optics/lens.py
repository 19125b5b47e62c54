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

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.lens import COEFFICIENTS, PINHOLE, LensName, lens_parameters

EitherArray = Array | NDArray[Any]
"""JAX's, or numpy's where all inputs are numpy's arrays."""
Numbers = Sequence[ArrayLike] | EitherArray
"""A vector of parameters; each may itself be an array, and all broadcast against each other."""
Distort = Callable[[Numbers, EitherArray, EitherArray], tuple[EitherArray, EitherArray]]
RadiusOfVariable = Callable[[FloatArray], FloatArray]


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
    radial_terms: tuple[str, ...]
    """Coefficients k1, k2, ... of the distorted radius q (1 + k1 q^2 + k2 q^4 + ...), in rising order."""
    undistorted_radius: RadiusOfVariable
    """Undistorted radius r = hypot(x, y) of the variable q >= 0 of that polynomial; infinite where no
    direction has this q. It increases with q."""
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

    def unfolded_radius(self, coefficients: Numbers) -> FloatArray:
        """Undistorted radius up to which each direction has an image point of its own; infinity if no fold.

        From there on the distorted radius shrinks, and even where it grows again further out the same image
        points are shown twice. Tangential terms are neglected. The zeros of the slope 1 + 3 k1 q^2 + 5 k2 q^4
        + ... are the inverse eigenvalues of the companion matrix of the polynomial in 1 / q^2.

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
        """Whether (x, y) lies nearer to the axis than the model's first fold; shapes broadcast."""
        radius = np.hypot(np.asarray(x, float), np.asarray(y, float))
        return np.asarray(radius < self.unfolded_radius(lens[len(PINHOLE) :]))


def as_array(x: ArrayLike) -> EitherArray:
    """A JAX array, except that numpy's stay: the same maths then runs on complex numbers uncompiled."""
    return x if isinstance(x, np.ndarray) else jnp.asarray(x)
