"""Calibrated sensor: ranges from spots and spots from ranges, with their covariance, by a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.calibration import Calibration
from workbench.optics.image import bend_px, in_picture
from workbench.optics.lens import LensModel
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY
from workbench.optics.rows import FLATNESS, Row, axes_of, rows_of
from workbench.sensor.curves import SpotCurves
from workbench.sensor.range_model import RangeEstimates, RangeModel

X, Y = np.eye(2)
"""Directions across the optical axis: to the right, and down."""
FAR_MM = 1000.0
"""Depth at which the length of a row is compared with that at the sensor."""


@dataclass(frozen=True)
class CalibratedSensor:
    """Sensor of a calibration."""

    calibration: Calibration
    overrides: Mapping[str, float] = field(default_factory=dict)
    """Parameters with another value than in the calibration, by name."""

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Laser ids in the order of the file."""
        return tuple(laser.id for laser in self.calibration.laser_ranger.lasers)

    @cached_property
    def _geometry(self) -> dict[str, float]:
        return self.calibration.geometry() | dict(self.overrides)

    @cached_property
    def _model(self) -> LensModel:
        return lens_model(self.calibration.distortion_model)

    @cached_property
    def _lens(self) -> FloatArray:
        """Parameters of the lens, in the model's order."""
        return np.array([self._geometry[name] for name in self._model.parameters])

    @cached_property
    def _rays(self) -> FloatArray:
        """(lasers, 4)."""
        return np.array([[self._geometry[f"{i}.{name}"] for name in RAY] for i in self.ids])

    @cached_property
    def _columns(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.calibration.laser_ranger.parameters.names)}

    @cached_property
    def _own_columns(self) -> IndexArray:
        """(lasers, C) columns of the lens and of each laser's ray."""
        lens = [self._columns[name] for name in self._model.parameters]
        return np.array([[*lens, *(self._columns[f"{i}.{name}"] for name in RAY)] for i in self.ids])

    @cached_property
    def covariance(self) -> FloatArray:
        """(P, P) of the calibration's parameters."""
        return self.calibration.laser_ranger.parameters.covariance_array

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Rows of the lasers, and the single ones, by their angle; each laser is in one."""
        return rows_of(self._rays)

    def axis(self, laser_id: str) -> FloatArray:
        """(2,) unit vector along which the laser's spot moves in the image."""
        return np.asarray(self._axes[self._index_of[laser_id]])

    @cached_property
    def _axes(self) -> FloatArray:
        return axes_of(self._rays)

    def row_at(self, angle_deg: int) -> Row | None:
        """Row of two lasers or more at an angle, that with the most lasers; None without one."""
        found = [row for row in self.rows if row.angle_deg == angle_deg and len(row.members) > 1]
        return max(found, key=lambda row: len(row.members), default=None)

    @cached_property
    def _origins(self) -> FloatArray:
        """(2, lasers) x and y."""
        return self._rays.T[[RAY.index("x_mm"), RAY.index("y_mm")]]

    @cached_property
    def _tangents(self) -> FloatArray:
        """(2, lasers) along x and y."""
        return self._rays.T[[RAY.index("tx"), RAY.index("ty")]]

    @cached_property
    def _beam_columns(self) -> IndexArray:
        """(2, 2, lasers) columns of origin and tangent, each along x and y."""
        names = (("x_mm", "y_mm"), ("tx", "ty"))
        return np.array(
            [[[self._columns[f"{i}.{name}"] for i in self.ids] for name in pair] for pair in names], np.intp
        )

    @cached_property
    def _fronts_mm(self) -> dict[Row, tuple[float, float]]:
        """Front of each row whose beams leave the sensor apart."""
        fronts = {}
        for row in self.rows:
            near, far = (self._row_ends_mm(row, depth) for depth in (0.0, FAR_MM))
            if np.ptp(near) > FLATNESS * np.ptp(far) or len(row.members) == 1:
                fronts[row] = near
        return fronts

    def _row_ends_mm(self, row: Row, depth_mm: float) -> tuple[float, float]:
        """Positions of the outer beams of a row along it."""
        places = row.direction @ (self._origins + self._tangents * depth_mm)[:, row.lasers]
        return float(places.min()), float(places.max())

    @cached_property
    def _index_of(self) -> dict[str, int]:
        return {laser_id: n for n, laser_id in enumerate(self.ids)}

    def _indices(self, laser_ids: Sequence[str]) -> IndexArray:
        """(n,) indices of lasers in the order of `ids`."""
        return np.array([self._index_of[i] for i in laser_ids], np.intp)

    def front_mm(self, row: Row, range_mm: float | FloatArray) -> tuple[float, float]:
        """From the first to the last laser of a row, mm along it.

        Where its beams leave the sensor at one point, as behind a grating, the front is that of their spots
        at `range_mm`; of several ranges, at their mean.
        """
        front = self._fronts_mm.get(row)
        return front or self._row_ends_mm(row, float(np.mean(range_mm)) + self.offset_mm)

    def across_mm(self, row: Row, range_mm: float) -> float:
        """Distance of a row from the optical axis at a range, to the right of its direction; mm.

        It is 0 for a row that passes by the axis as closely as its own beams deviate from it.
        """
        depth = range_mm + self.offset_mm
        places = (self._origins + self._tangents * depth)[:, row.lasers]
        across = float((np.array([-row.direction[1], row.direction[0]]) @ places).mean())
        near, far = self._row_ends_mm(row, depth)
        return 0.0 if abs(across) <= FLATNESS * max(far - near, np.hypot(*places).max()) else across

    @cached_property
    def _curves(self) -> SpotCurves:
        return SpotCurves(self._model, self._lens, self._rays)

    @cached_property
    def _range_model(self) -> RangeModel:
        offset = self._columns["offset_mm"]
        return RangeModel(self._curves, self.offset_mm, self._own_columns, offset, self.covariance)

    @property
    def offset_mm(self) -> float:
        """Distance of the pinhole behind the reference plane."""
        return self._geometry["offset_mm"]

    def spot_px(self, laser_id: str, range_mm: FloatArray) -> FloatArray:
        """(n, 2) position of the laser's spot at ranges (n,); infinity allowed."""
        return self._curves.spots(*self._points(laser_id, range_mm))

    def spot_gradient(self, laser_id: str, range_mm: FloatArray) -> FloatArray:
        """(n, 2, P) derivatives of `spot_px` by the calibration's parameters, in the order of its names."""
        laser, w = self._points(laser_id, range_mm)
        by = self._curves.gradients(laser, w)
        gradient = np.zeros((len(w), 2, len(self._columns)))
        gradient[:, :, self._own_columns[self.ids.index(laser_id)]] = by[:, :, :-1]
        gradient[:, :, self._columns["offset_mm"]] = -by[:, :, -1] * w[:, None] ** 2
        return gradient

    def ranges(
        self,
        laser_ids: Sequence[str],
        position_px: FloatArray,
        sd_px: FloatArray,
        speckle_sd_px: FloatArray | None = None,
    ) -> RangeEstimates:
        """Ranges of n spots with known lasers.

        Args:
            laser_ids: the laser of each spot, n of them.
            position_px: (n, 2) u, v; NaN where a coordinate was not measured.
            sd_px: (n, 2) 1 sigma of the spot's noise without speckle, which is added here; NaN: that of the
                calibration.
            speckle_sd_px: (n, 2) 1 sigma by speckle; NaN or None: that of the calibration.
        """
        return self.ranges_of(self._indices(laser_ids), position_px, sd_px, speckle_sd_px)

    def ranges_of(
        self,
        laser: IndexArray,
        position_px: FloatArray,
        sd_px: FloatArray,
        speckle_sd_px: FloatArray | None = None,
    ) -> RangeEstimates:
        """`ranges` for lasers given by their indices (n,) in the order of `ids`."""
        return self._range_model.ranges(laser, position_px, self._total_sd(sd_px, speckle_sd_px))

    def _total_sd(self, sd_px: FloatArray, speckle_sd_px: FloatArray | None) -> FloatArray:
        """(n, 2) 1 sigma by noise and speckle.

        Speckle is scaled as the calibration scaled it by its residuals, which its own value includes.
        """
        file = self.calibration.laser_ranger
        own_sd = np.where(np.isfinite(sd_px), sd_px, file.noise.spot_sd_px)
        if speckle_sd_px is None:
            return np.hypot(own_sd, file.noise.speckle_sd_px)
        scaled = speckle_sd_px * file.fit.noise_scale
        return np.hypot(own_sd, np.where(np.isfinite(scaled), scaled, file.noise.speckle_sd_px))

    def places(
        self, laser_ids: Sequence[str], direction: FloatArray, ranges: RangeEstimates
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Positions of n spots along a direction across the optical axis, origin + tangent x depth.

        Args:
            laser_ids: the laser of each spot, n of them.
            direction: (2,) unit vector, such as that of a row.
            ranges: (n) of the spots.

        Returns:
            (n,) positions, mm; (n, P) derivatives by the parameters of the calibration; (n,) derivatives by
            the range (the tangents).
        """
        laser = self._indices(laser_ids)
        origin, tangent = direction @ self._origins[:, laser], direction @ self._tangents[:, laser]
        depth = ranges.range_mm + self.offset_mm
        gradient = ranges.by_parameter * tangent[:, None]
        gradient[:, self._columns["offset_mm"]] = 0.0  # the reference plane does not affect the position
        spots = np.arange(len(laser))
        for share, of_origin, of_tangent in zip(direction, *self._beam_columns[:, :, laser], strict=True):
            if share:  # half of the work for a horizontal or vertical row
                gradient[spots, of_origin] += share
                gradient[spots, of_tangent] += share * depth
        return origin + tangent * depth, gradient, tangent

    def positions_mm(self, laser_ids: Sequence[str], range_mm: FloatArray) -> FloatArray:
        """(2, n) positions of spots at ranges (n,) along x and y."""
        laser = self._indices(laser_ids)
        return np.asarray(self._origins[:, laser] + self._tangents[:, laser] * (range_mm + self.offset_mm))

    def relative_range_sd(self, laser_id: str, range_mm: FloatArray) -> FloatArray:
        """(n,) relative 1 sigma of a single range, for spots with the noise in the calibration."""
        return np.asarray(self.typical_ranges(laser_id, range_mm).sigma_mm / range_mm)

    def typical_ranges(self, laser_id: str, range_mm: FloatArray) -> RangeEstimates:
        """Estimates for spots exactly at ranges (n,), with the noise in the calibration."""
        laser = np.full(len(range_mm), self._index_of[laser_id], np.intp)
        typical_sd = self._total_sd(np.full((len(range_mm), 2), np.nan), None)
        return self._range_model.expected(laser, np.asarray(range_mm, float), typical_sd)

    def in_frame(self, laser_id: str, range_mm: FloatArray) -> BoolArray:
        """(n,) whether the laser's spot lies in the image and before the fold of the lens model."""
        inside = in_picture(self.spot_px(laser_id, range_mm), self._size_px)
        return inside & self._curves.is_unfolded(*self._points(laser_id, range_mm))

    def bend_px(self, laser_id: str, nearest_mm: float, point_px: FloatArray, direction: FloatArray) -> float:
        """Largest distance of a laser's spots from a straight line; see `workbench.optics.image.bend_px`.

        Args:
            laser_id: the laser.
            nearest_mm: range of the nearest spot; the farthest is at infinity.
            point_px: (2,) a point of the line.
            direction: (2,) its direction, of any length.
        """
        ray, depth_mm = self._rays[self.ids.index(laser_id)], nearest_mm + self.offset_mm
        return bend_px(self._model, self._lens, ray, depth_mm, self._size_px, (point_px, direction))

    @property
    def _size_px(self) -> tuple[int, int]:
        """(width, height) of the image."""
        return self.calibration.image_width, self.calibration.image_height

    def _points(self, laser_id: str, range_mm: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Index of the laser, n times, and the inverse depths of ranges (n,)."""
        index = np.full(len(range_mm), self.ids.index(laser_id), np.intp)
        return index, 1.0 / (np.asarray(range_mm, float) + self.offset_mm)
