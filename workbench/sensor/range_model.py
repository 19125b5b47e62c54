"""Ranges of spots with their covariance, from values and covariance of a calibration's parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.sensor.curves import SpotCurves


@dataclass(frozen=True)
class RangeEstimates:
    """Ranges of n spots from the reference plane, mm; not finite where a spot has no range."""

    range_mm: FloatArray
    """(n,)"""
    spot_sd_mm: FloatArray
    """(n,) 1 sigma from the spots alone, independent between spots."""
    by_parameter: FloatArray
    """(n, P) derivatives of the ranges by the parameters of the calibration, in the order of its names."""
    calibration_covariance: FloatArray
    """(P, P) of the calibration's parameters."""
    misfit_sd: FloatArray
    """(n,) distance of each spot from its laser's line, in standard deviations of spot and line together."""

    @cached_property
    def covariance_mm2(self) -> FloatArray:
        """(n, n) of the ranges, by spots and calibration; ranges of one calibration share its error."""
        covariance: FloatArray = self._propagated @ self.by_parameter.T
        covariance[np.diag_indices(len(covariance))] += self.spot_sd_mm**2
        return covariance

    @cached_property
    def sigma_mm(self) -> FloatArray:
        """(n,) 1 sigma of each range."""
        return np.asarray(np.sqrt((self._propagated * self.by_parameter).sum(axis=1) + self.spot_sd_mm**2))

    @cached_property
    def _propagated(self) -> FloatArray:
        """(n, P) covariance of the ranges with the parameters."""
        return self.by_parameter @ self.calibration_covariance

    def only(self, index: IndexArray | BoolArray | slice) -> RangeEstimates:
        """Estimates of the spots `index`."""
        return RangeEstimates(
            self.range_mm[index],
            self.spot_sd_mm[index],
            self.by_parameter[index],
            self.calibration_covariance,
            self.misfit_sd[index],
        )


@dataclass(frozen=True)
class RangeModel:
    """Inverse of the model of L lasers, with the derivatives by the P parameters of a calibration."""

    curves: SpotCurves
    offset_mm: float
    """Distance of the pinhole behind the reference plane."""
    own: IndexArray
    """(L, C) indices of the parameters of the lens and of each laser's ray."""
    offset: int
    """Index of the parameter `offset_mm`."""
    covariance: FloatArray
    """(P, P) of the parameters."""

    def ranges(self, laser: IndexArray, position_px: FloatArray, sd_px: FloatArray) -> RangeEstimates:
        """Ranges of n spots; each is computed alone.

        Args:
            laser: (n,) index of each spot's laser.
            position_px: (n, 2) u, v; NaN where a coordinate was not measured.
            sd_px: (n, 2) 1 sigma by noise and speckle.
        """
        from workbench.sensor.inversion_kernels import propagate  # loads the compiler

        measured = np.isfinite(position_px)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # no range, or infinite
            found = self.curves.invert(laser, np.where(measured, position_px, 0.0), measured / sd_px)
            w = found.inverse_depth_per_mm
            range_mm = np.where(w <= 0, np.inf, 1.0 / w) - self.offset_mm
        gradient, misfit_sd = propagate(
            laser, found.dz, found.across_sd, found.dacross, self.own, self.offset, self.covariance
        )
        return RangeEstimates(range_mm, found.z_sd_of_spot_mm, gradient, self.covariance, misfit_sd)

    def expected(self, laser: IndexArray, range_mm: FloatArray, sd_px: FloatArray) -> RangeEstimates:
        """Estimates for spots exactly at n ranges, without a search for these; not finite beyond the fold.

        Args:
            laser: (n,) index of each spot's laser.
            range_mm: (n,) from the reference plane.
            sd_px: (n, 2) 1 sigma of the spots by noise and speckle.
        """
        w = 1.0 / (range_mm + self.offset_mm)
        gradients = self.curves.gradients(laser, w) / sd_px[:, :, None]
        by, slope = gradients[:, :, :-1], gradients[:, :, -1]
        information = np.where(self.curves.is_unfolded(laser, w), np.vecdot(slope, slope), np.nan)
        # At a fixed spot dw = -(slope . by) / information, and z = 1 / w.
        dz = (slope[:, :, None] * by).sum(axis=1) / (information * w**2)[:, None]
        gradient = np.zeros((len(laser), len(self.covariance)))
        gradient[np.arange(len(laser))[:, None], self.own[laser]] = dz
        gradient[:, self.offset] = -1.0
        spot_sd_mm = 1.0 / (w**2 * np.sqrt(information))
        return RangeEstimates(range_mm, spot_sd_mm, gradient, self.covariance, np.zeros(len(laser)))
