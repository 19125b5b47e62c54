"""Chain of the workbench for the thesis's scenes: frames, spots, ranges, shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import degrees

import numpy as np
from numpy.random import Generator

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.calibration import (
    Calibration,
    FitSummary,
    LaserRanger,
    LaserRay,
    Matrix,
    Noise,
    Parameters,
    Provenance,
    ReferencePlane,
    Validity,
)
from workbench.model.lens import COEFFICIENTS, lens_parameters
from workbench.optics.rays import RAY
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.ranging.shape import Shape
from workbench.spots import Finding, Spot, SpotFinder
from workbench.trials.thesis.camera import BAND_PX, expose
from workbench.trials.thesis.scene import LaserLine, Outcome

TYPICAL_SPOT_SD_PX = 0.01


@dataclass(frozen=True)
class Chain:
    """Chain for one line of lasers with an exact calibration."""

    line: LaserLine
    noisy: bool
    """Whether frames have shot noise, read noise and speckle; otherwise they are only rounded."""
    span_mm: tuple[float, float]
    """Nearest and farthest standoff of the calibration's validity."""

    def read(self, depths_mm: FloatArray, lit: BoolArray, rng: Generator) -> Outcome:
        """One reading, see `thesis_chain.read`; `rng` generates the noise."""
        spots = self.line.spots_px(depths_mm)
        if self.noisy:
            spots = spots + self.line.speckle_sd_px * rng.standard_normal(len(spots))

        def capture(ids: tuple[str, ...]) -> Finding:
            on_lasers = lit & np.isin(self.line.ids, ids)
            on, off = expose(self.line, depths_mm, spots, on_lasers, rng if self.noisy else None)
            found = self._finders[ids].find(on, off)
            return replace(found, spots=tuple(map(_without_speckle, found.spots)))

        return _outcome(acquire(self.ranger, "simulated", capture))

    @cached_property
    def ranger(self) -> Ranger:
        """Ranger with the exact calibration of the line."""
        return Ranger(exact_calibration(self.line, self.noisy, self.span_mm))

    @cached_property
    def _finders(self) -> dict[tuple[str, ...], SpotFinder]:
        size = self.ranger.size_px[::-1]
        sets = [self.line.ids, *((i,) for i in self.line.ids)]
        return {ids: SpotFinder(size, self.ranger.searched(ids), expected=len(ids)) for ids in sets}


def _without_speckle(spot: Spot) -> Spot:
    """Spot with the calibration's speckle, which shifts whole spots here, and is not seen in the frame."""
    return replace(spot, u_speckle_sd_px=None, v_speckle_sd_px=None)


def _outcome(reading: Reading) -> Outcome:
    if not reading.lines:
        return Outcome(None, "none")
    shape = reading.lines[0].shape
    angle = degrees(shape.angle_rad) if shape.kind == "incline" and shape.angle_rad is not None else None
    return Outcome(shape.closest_mm, _name(shape), angle, shape.closest_sigma_mm)


def _name(shape: Shape) -> str:
    return f"round {shape.degree}" if shape.kind == "round" else shape.kind


def exact_calibration(line: LaserLine, noisy: bool, span_mm: tuple[float, float]) -> Calibration:
    """Calibration of an ideal line without uncertainty."""
    width, height = (line.length_px, BAND_PX) if line.axis == "u" else (BAND_PX, line.length_px)
    cx, cy = (line.centre_px, BAND_PX / 2) if line.axis == "u" else (BAND_PX / 2, line.centre_px)
    f = line.f_px
    origins = {i: (b, 0.0) if line.axis == "u" else (0.0, b) for i, b in line.baselines_by_id.items()}
    values = dict.fromkeys(lens_parameters("plumb_bob"), 0.0) | {
        "f_px": f,
        "cx_px": cx,
        "cy_px": cy,
        "offset_mm": 0.0,
    }
    for i, (x, y) in origins.items():
        values |= {f"{i}.{name}": value for name, value in zip(RAY, (x, y, 0.0, 0.0), strict=True)}
    coefficients, count = COEFFICIENTS["plumb_bob"], len(values)
    zeros = (0.0,) * count
    return Calibration(
        image_width=width,
        image_height=height,
        camera_name="simulated",
        camera_matrix=Matrix(rows=3, cols=3, data=(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0)),
        distortion_model="plumb_bob",
        distortion_coefficients=Matrix(rows=1, cols=len(coefficients), data=(0.0,) * len(coefficients)),
        rectification_matrix=Matrix(rows=3, cols=3, data=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)),
        projection_matrix=Matrix(rows=3, cols=4, data=(f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0)),
        laser_ranger=LaserRanger(
            format=1,
            reference_plane=ReferencePlane(offset_mm=0.0),
            lasers=tuple(
                LaserRay(id=i, axis=line.axis, origin_mm=(x, y, 0.0), direction=(0.0, 0.0, 1.0))
                for i, (x, y) in origins.items()
            ),
            noise=Noise(spot_sd_px=TYPICAL_SPOT_SD_PX, speckle_sd_px=line.speckle_sd_px if noisy else 0.0),
            parameters=Parameters(
                names=tuple(values),
                units=("1",) * count,
                values=tuple(values.values()),
                sd=zeros,
                prior_sd=zeros,
                data_share=zeros,
                determined_by=("prior",) * count,
                covariance=Matrix(rows=count, cols=count, data=(0.0,) * count**2),
            ),
            validity=Validity(standoff_mm=span_mm, max_relative_range_sd=0.0),
            fit=FitSummary(rms_px=0.0, observations=0, rejected=0, noise_scale=1.0, verdict="accepted"),
            provenance=Provenance(**dict.fromkeys(Provenance.model_fields, "")),
        ),
    )
