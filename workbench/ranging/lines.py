"""Shape in front of one row of lasers, from the ranges of its spots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.image import extent_px
from workbench.optics.rows import Row
from workbench.ranging.points import Points
from workbench.ranging.shape import DEFAULT_PRIOR, Shape, fit_shape
from workbench.ranging.shape_prior import ShapePrior
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.range_model import RangeEstimates

Weights = Literal["information", "pixels"]


@dataclass(frozen=True)
class LineShape:
    """Shape in front of one row of lasers, and the ranges that it was fitted to.

    That of a laser on no row is `unknown`, with its range as the closest one.
    """

    row: Row
    shape: Shape
    indices: tuple[int, ...]
    """Indices of the line's ranges among those of the reading."""
    closest_by_parameter: FloatArray
    """(P,) derivatives of the reported shape's closest range by the calibration's parameters, through ranges
    and places."""
    closest_spot_sd_mm: FloatArray
    """(n,) 1 sigma of the reported shape's closest range by the noise of each spot."""


def fit_line(
    sensor: CalibratedSensor,
    row: Row,
    ids: Sequence[str],
    ranges: RangeEstimates,
    indices: Sequence[int],
    prior: ShapePrior = DEFAULT_PRIOR,
) -> LineShape:
    """Fit the shape in front of one row.

    A spot lies where its beam meets the surface, not at the origin of the beam. Errors of this position and
    of the range are correlated, because both come from the calibration. The front reaches from the first to
    the last laser of the row, with or without a spot.

    Args:
        sensor: the calibrated sensor.
        row: the row.
        ids: lasers of all ranges of the reading.
        ranges: all ranges of the reading.
        indices: indices of the row's ranges.
        prior: prior over shapes.
    """
    own = ranges if len(indices) == len(ids) else ranges.only(np.asarray(indices, np.intp))
    place, by_parameter, tangent = sensor.places([ids[i] for i in indices], row.direction, own)
    propagated, spot = by_parameter @ sensor.covariance, own.spot_sd_mm**2
    of_places, cross = propagated @ by_parameter.T, own.by_parameter @ propagated.T
    own_noise = np.diag_indices(len(spot))
    of_places[own_noise] += tangent**2 * spot
    cross[own_noise] += tangent * spot
    points = Points(place, own.range_mm, own.covariance_mm2, sensor.offset_mm, of_places, cross)
    shape = fit_shape(points, sensor.front_mm(row, own.range_mm), prior, len(row.members))
    by_parameter = shape.closest_by_range @ own.by_parameter + shape.closest_by_place @ by_parameter
    spot_sd = (shape.closest_by_range + shape.closest_by_place * tangent) * own.spot_sd_mm
    return LineShape(row, shape, tuple(indices), by_parameter, spot_sd)


def _known_variance(line: LineShape, covariance: FloatArray) -> float:
    """Variance of the closest range by spots and calibration, given the reported shape, mm2."""
    by_calibration = line.closest_by_parameter @ covariance @ line.closest_by_parameter
    return float(by_calibration + line.closest_spot_sd_mm @ line.closest_spot_sd_mm)


def shape_variance(line: LineShape, covariance: FloatArray) -> float:
    """Variance of the closest range beyond that by spots and calibration, mm2."""
    return max(0.0, line.shape.closest_sigma_mm**2 - _known_variance(line, covariance))


def mean_of_lines(
    lines: Sequence[LineShape], covariance: FloatArray, weights: Weights, size_px: tuple[int, int]
) -> tuple[float, float]:
    """Mean of the lines' closest ranges and its 1 sigma, mm.

    `information` weights by 1 / sigma^2, `pixels` by the image's extent along each row, as the thesis does.
    The lines share the error of the calibration, which averaging does not reduce; `covariance` (P, P) is that
    of its parameters. The rest of a line's sigma, by its shape, is its own.
    """
    if len(lines) == 1:
        known = _known_variance(lines[0], covariance)
        return lines[0].shape.closest_mm, math.sqrt(max(known, lines[0].shape.closest_sigma_mm ** 2))
    by_information = [1.0 / line.shape.closest_sigma_mm**2 for line in lines]
    by_pixels = [extent_px(line.row.direction, size_px) for line in lines]
    weight = np.array(by_information if weights == "information" else by_pixels)
    weight /= weight.sum()
    by_parameter = weight @ np.array([line.closest_by_parameter for line in lines])
    by_spot = [share * line.closest_spot_sd_mm for share, line in zip(weight, lines, strict=True)]
    by_shape = weight**2 @ [shape_variance(line, covariance) for line in lines]
    variance = by_parameter @ covariance @ by_parameter + sum(float(sd @ sd) for sd in by_spot) + by_shape
    mean = float(weight @ [line.shape.closest_mm for line in lines])
    return mean, float(np.sqrt(variance))
