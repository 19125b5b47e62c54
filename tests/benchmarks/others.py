"""Other people's centres, each on the same cut-out around the brightest pixel."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from photutils.centroids import centroid_2dg, centroid_quadratic  # type: ignore[import-untyped]
from skimage.filters import threshold_otsu
from skimage.measure import label, regionprops

from workbench.model.arrays import FloatArray

Centre = tuple[float, float]


def cut_out(frame: NDArray[np.generic], centre: tuple[int, int], half: int) -> FloatArray:
    """The frame around (row, column), background (median of the frame) taken off."""
    row, col = centre
    part: FloatArray = frame[row - half : row + half + 1, col - half : col + half + 1].astype(np.float64)
    return part - float(np.median(frame.astype(np.float64)))


def thresholded_centroid(image: FloatArray) -> Centre:
    """Mean position of what exceeds half of the peak, weighted by its height."""
    kept = np.where(image > 0.5 * image.max(), image, 0.0)
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    return float((kept * u).sum() / kept.sum()), float((kept * v).sum() / kept.sum())


def scikit_image(image: FloatArray) -> Centre:
    """Otsu's threshold, labels, weighted centroid of the brightest region."""
    labels = label(image > threshold_otsu(image))  # type: ignore[no-untyped-call]
    regions = regionprops(labels, intensity_image=image)  # type: ignore[no-untyped-call]
    best = max(regions, key=lambda r: float(r.image_intensity.sum()))
    v, u = best.centroid_weighted
    return float(u), float(v)


def photutils_2dg(image: FloatArray) -> Centre:
    """Fit of a sampled two-dimensional Gaussian."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        u, v = centroid_2dg(image)
    return float(u), float(v)


def photutils_quadratic(image: FloatArray) -> Centre:
    """Parabola through the pixels around the peak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        u, v = centroid_quadratic(image, fit_boxsize=5)
    return float(u), float(v)


OTHERS = {
    "threshold": thresholded_centroid,
    "skimage": scikit_image,
    "photutils 2dg": photutils_2dg,
    "photutils quadratic": photutils_quadratic,
}
