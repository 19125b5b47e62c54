"""Layout of the parameter vector of a fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.calibration.model.parameters import DRIFT, PLACEMENT, POSE, PRINT, REFERENCE, STEP
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.board import BOW
from workbench.model.lens import LensName
from workbench.optics.lens import LensModel
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY


class Layout(NamedTuple):
    """Indices of each block of parameters, by lens model and number of lasers, placements and boards.

    The order is lens, reference, rays; print scale if there are boards; placements; sag and poses of the
    boards; steps between the parts of the session. The layout of one laser and one placement is that of the
    inputs of `prediction.predict_cell`.
    """

    lens_name: LensName
    lasers: int = 1
    placements: int = 1
    boards: int = 0
    """Placements at which the board was seen."""
    parts: int = 1
    """Uninterrupted parts of the session that the image may have shifted between; 1 without a drift."""

    @property
    def model(self) -> LensModel:
        """The lens model."""
        return lens_model(self.lens_name)

    @property
    def lens(self) -> slice:
        """Parameters of the lens."""
        return slice(0, len(self.model.parameters))

    @property
    def reference(self) -> slice:
        """REFERENCE."""
        return slice(self.lens.stop, self.lens.stop + len(REFERENCE))

    @property
    def offset(self) -> int:
        """Index of `offset_mm`."""
        return len(self.model.parameters) + REFERENCE.index("offset_mm")

    @property
    def ruler_scale(self) -> int:
        """Index of `ruler_scale`."""
        return len(self.model.parameters) + REFERENCE.index("ruler_scale")

    @property
    def bench_only(self) -> slice:
        """REFERENCE without `offset_mm`: the bench during the calibration, of no effect on a range."""
        return slice(self.offset + 1, self.reference.stop)

    @property
    def drift(self) -> slice:
        """DRIFT."""
        start = len(self.model.parameters) + REFERENCE.index(DRIFT[0])
        return slice(start, start + len(DRIFT))

    @property
    def common(self) -> slice:
        """Parameters that all lasers share: lens and reference."""
        return slice(0, self.reference.stop)

    @property
    def rays(self) -> slice:
        """RAY of every laser."""
        return slice(self.common.stop, self.common.stop + len(RAY) * self.lasers)

    def ray(self, laser: int) -> slice:
        """RAY of one laser, by its index."""
        start = self.rays.start + len(RAY) * laser
        return slice(start, start + len(RAY))

    def own(self, laser: int) -> IndexArray:
        """Indices of the parameters of one laser's spot curve: the lens, then its ray."""
        return np.asarray(np.r_[self.lens, self.ray(laser)], np.intp)

    @property
    def print_scale(self) -> slice:
        """PRINT; empty without boards."""
        return slice(self.rays.stop, self.rays.stop + (len(PRINT) if self.boards else 0))

    @property
    def sensor(self) -> slice:
        """Parameters of the calibration; those of placements and boards follow."""
        return slice(0, self.print_scale.stop)

    @property
    def errors(self) -> slice:
        """PLACEMENT of every placement."""
        return slice(self.sensor.stop, self.sensor.stop + len(PLACEMENT) * self.placements)

    @property
    def bow(self) -> slice:
        """BOW of the board."""
        return slice(self.errors.stop, self.errors.stop + len(BOW))

    @property
    def poses(self) -> slice:
        """POSE of every board."""
        return slice(self.bow.stop, self.bow.stop + len(POSE) * self.boards)

    @property
    def steps(self) -> slice:
        """STEP between each part of the session and the next."""
        start = self.poses.stop if self.boards else self.errors.stop
        return slice(start, start + len(STEP) * (self.parts - 1))

    @property
    def offsets_by_step(self) -> FloatArray:
        """(parts, parts - 1) offset of the image in each part from the mean of all, by unit steps."""
        after = np.tri(self.parts, self.parts - 1, -1)
        return np.asarray(after - after.mean(axis=0), np.float64)
