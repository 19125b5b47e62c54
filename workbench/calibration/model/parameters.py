"""Parameters of a calibration with their units and priors, for fit, report and YAML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Literal

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.board import BOW
from workbench.model.prior import Prior
from workbench.model.rig import TARGET_TILT, Rig
from workbench.optics.rays import RAY

DRIFT = ("drift_u_px", "drift_v_px")
"""Shift of the image over the running time of the session, from the first capture to the last."""
DRIFT_SD_PX = 0.5
"""Prior deviation of a drift that the data show, px over the session, and of a step."""
STEP = ("step_u_px", "step_v_px")
"""Shift of the image from the end of one part of the session to the beginning of the next."""
REFERENCE = ("offset_mm", "ruler_scale", *TARGET_TILT, *DRIFT)
"""Of the bench during the session; `offset_mm` alone is of use afterwards."""
PLACEMENT = ("error_mm", "slope_x", "slope_y")
PRINT = ("print_scale",)
"""Scale of the printed board. A sensor parameter, as the ruler's scale is: both scale its lengths."""
POSE = ("board_x_mm", "board_y_mm", "board_roll_rad")
"""Pose of the board on the plane of a placement, see `workbench.optics.board.Pose`."""

ParameterKind = Literal["sensor", "placement", "part"]


@dataclass(frozen=True)
class Parameter:
    """Parameter of the fit, with its Gaussian prior (1 sigma)."""

    name: str
    unit: str
    prior: Prior
    kind: ParameterKind
    """`sensor`: belongs to the calibration; `placement`: a nuisance parameter of the target or a placement;
    `part`: one of the parts of the session."""


def sensor_parameters(rig: Rig) -> tuple[Parameter, ...]:
    """Parameters of the sensor and its ruler, in the order lens, reference, rays of each laser."""
    lens = [sensor_parameter(name, prior) for name, prior in rig.camera.lens_priors.items()]
    reference = [sensor_parameter(name, getattr(rig.bench, name)) for name in REFERENCE]
    rays = [
        sensor_parameter(f"{laser.id}.{name}", getattr(laser, name)) for laser in rig.lasers for name in RAY
    ]
    return (*lens, *reference, *rays)


def placement_parameters(rig: Rig, placements: Sequence[str]) -> tuple[Parameter, ...]:
    """Nuisance parameters: error along the axis and tilts of each placement of the target."""
    position = Prior(value=0.0, sd=rig.bench.placement_sd_mm)
    # The tangent of a tilt of a few degrees is the tilt to 0.1 %: its prior may be Gaussian too.
    tilt = Prior(value=0.0, sd=radians(rig.bench.tilt_sd_deg))
    priors = dict(zip(PLACEMENT, (position, tilt, tilt), strict=True))
    return tuple(
        Parameter(f"{key}.{name}", unit_of(name), priors[name], "placement")
        for key in placements
        for name in PLACEMENT
    )


def board_parameters(rig: Rig) -> tuple[Parameter, ...]:
    """Nuisance parameters: sag of the board's paper."""
    flat = Prior(value=0.0, sd=rig.bench.board_flatness_sd_mm)
    return tuple(Parameter(name, unit_of(name), flat, "placement") for name in BOW)


def fits_drift(rig: Rig) -> bool:
    """Whether the drift is a free parameter; with it are the steps between the parts of a session."""
    return any(getattr(rig.bench, name).sd > 0 for name in DRIFT)


def step_parameters(parts: int) -> tuple[Parameter, ...]:
    """Nuisance parameters: steps of the image between the parts of a session."""
    step = Prior(value=0.0, sd=DRIFT_SD_PX)
    return tuple(
        Parameter(f"part {number}.{name}", unit_of(name), step, "part")
        for number in range(1, parts)
        for name in STEP
    )


def unit_of(name: str) -> str:
    """Unit by the suffix of a parameter's name; "1" for slopes and distortion coefficients."""
    if name.endswith("_px"):
        return "px"
    if name.endswith("_mm"):
        return "mm"
    if name.endswith("_rad"):
        return "rad"
    return "1"


@dataclass(frozen=True)
class ParameterTable:
    """All P parameters of one fit. A parameter with prior sd 0 is a constant.

    The fit solves for `y = (value - prior mean) / prior sd`. The prior of y is the unit Gaussian, and the
    problem is well scaled if the rig file's priors are realistic.
    """

    parameters: tuple[Parameter, ...]

    @property
    def prior_mean(self) -> FloatArray:
        """Prior means of all parameters, (P,), each in its unit."""
        return np.array([p.prior.value for p in self.parameters])

    @property
    def prior_sd(self) -> FloatArray:
        """Prior standard deviations of all parameters, (P,), each in its unit."""
        return np.array([p.prior.sd for p in self.parameters])

    @property
    def free(self) -> IndexArray:
        """Indices of the free parameters."""
        return np.flatnonzero(self.prior_sd > 0)

    def with_wider_priors(self, indices: IndexArray, factor: float) -> ParameterTable:
        """The table with the prior sd of some parameters multiplied."""
        wider = list(self.parameters)
        for i in indices.tolist():
            prior = wider[i].prior
            wider[i] = replace(wider[i], prior=prior.model_copy(update={"sd": factor * prior.sd}))
        return ParameterTable(tuple(wider))

    @property
    def is_sensor(self) -> BoolArray:
        """(P,) whether each parameter belongs to the sensor."""
        return np.array([p.kind == "sensor" for p in self.parameters])


def sensor_parameter(name: str, prior: Prior) -> Parameter:
    """A `sensor` parameter with its unit."""
    return Parameter(name, unit_of(name), prior, "sensor")
