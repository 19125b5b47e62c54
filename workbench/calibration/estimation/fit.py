"""The fit: maximum a posteriori by non-linear least squares, and its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import radians, tan

import numpy as np

from workbench.calibration.checks.out_of_frame import name_out_of_frame
from workbench.calibration.data.boards import BoardView, PoseGuess, guess_pose, with_placements
from workbench.calibration.data.observations import (
    MeanObservations,
    Observation,
    PlacementInfo,
    Rejected,
    group,
    positions,
)
from workbench.calibration.estimation.placement_scatter import placement_scatter
from workbench.calibration.estimation.problem import LeastSquaresProblem, Solution, layout_of
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import (
    PLACEMENT,
    POSE,
    PRINT,
    Parameter,
    ParameterTable,
    board_parameters,
    placement_parameters,
    sensor_parameter,
    sensor_parameters,
    unit_of,
)
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import TermSummary
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.rig import Prior, Rig
from workbench.sensor.curves import SpotCurves

POSE_SD = {"slope_x": 1.0, "slope_y": 1.0, "board_x_mm": 100.0, "board_y_mm": 100.0, "board_roll_rad": 1.0}
"""A board's pose is what its corners say: these priors about the first guess are wider than it could err."""
FLAT_PRIOR_SD = 1e3
"""A prior this many times wider than stated is as good as none."""


@dataclass(frozen=True)
class CalibrationFit:
    """A fitted calibration. P parameters (sensor first), N cells, K corners of boards, 1 sigma throughout."""

    rig: Rig
    table: ParameterTable
    cells: MeanObservations
    rejected: tuple[Rejected, ...]
    values: FloatArray
    """(P,) maximum a posteriori."""
    covariance: FloatArray
    """(P, P) posterior."""
    prior_pull: FloatArray
    """(P,) value - prior mean in units of the prior's sd; 0 for constants."""
    data_share: FloatArray
    """(P,) see `data_share`."""
    residual_px: FloatArray
    """(N, 2) measured - predicted mean positions; NaN where not measured."""
    boards: tuple[BoardView, ...]
    corner_residual_px: FloatArray
    """(K, 2) measured - predicted corners, board by board."""
    rms_px: float
    """Over all single positions of spots used, not over the means."""
    noise_scale: float
    """Factor on the stated pixel noise that the residuals called for; 1 where they agree with it."""
    placement_scale: float
    """Factor on the stated deviations of placements that their fitted errors called for; 1 likewise."""
    chi2: float
    """Of the data at the stated noise."""
    degrees_of_freedom: float
    """Data minus the effective number of parameters that they determine."""
    converged: bool
    terms: tuple[TermSummary, ...] = ()
    """What the data say of parts of the model, where it was asked (`significance.choose`)."""

    @property
    def sd(self) -> FloatArray:
        """(P,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def layout(self) -> Layout:
        """Where the parameters stand among all P."""
        return layout_of(self.rig, self.cells, self.boards)

    @cached_property
    def curves(self) -> SpotCurves:
        """Positions of the lasers' spots, by the fitted lens and rays."""
        layout = self.layout
        rays = self.values[layout.rays].reshape(layout.lasers, -1)
        return SpotCurves(layout.model, self.values[layout.lens], rays)

    @property
    def corner_rms_px(self) -> float:
        """Over all corners of boards; NaN where there are none."""
        corners = self.corner_residual_px
        return float(np.sqrt(np.mean(corners**2))) if corners.size else float("nan")

    @property
    def used(self) -> tuple[Observation, ...]:
        """Every observation that the fit rests on."""
        return tuple(s for members in self.cells.members for s in members)

    @property
    def sensor(self) -> slice:
        """Where the sensor's parameters stand among all."""
        return self.layout.sensor


def fit(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """Fit the rig's parameters to observations of a flat target, and to the printed board where it was one.

    The estimate maximises the posterior of Gaussian noise and the rig's Gaussian priors. Placement errors and
    tilts are parameters with priors, so that repeats at one placement count as what they are: one placement.
    Where the residuals are significantly larger than the stated noise, the noise is scaled to them (with the
    effective number of parameters taken off) and the fit repeated.

    Args:
        rig: priors and noise.
        observations: spots at known standoffs.
        rejected: what was already rejected before, to be listed with the fit's own.
        boards: what was seen of the board, one view for each placement that had it as its target.

    Raises:
        BadInputError: no observations, one of a laser that the rig does not have, placements that contradict
            themselves, or a target that the rig file puts behind the pinhole.
        LimitFailedError: the fit does not come to a finite result.
    """
    _check(rig, observations)
    cells, strays = group(observations, rig.laser_ids, rig.noise)
    if not cells.placements:
        raise BadInputError(
            f"no spot is left to fit: all {len(strays)} observations are apart from the repeats of their spot,"
            f" as {strays[0].reason} ({strays[0].source})"
        )
    return fit_cells(rig, with_placements(cells, boards), (*rejected, *strays), boards)


def fit_cells(
    rig: Rig, cells: MeanObservations, rejected: Sequence[Rejected] = (), boards: Sequence[BoardView] = ()
) -> CalibrationFit:
    """As `fit`, of what is averaged already, with the boards' placements among the cells'.

    Raises:
        LimitFailedError: the fit does not come to a finite result.
    """
    table = table_of(rig, cells.placements, boards)
    solution, scale = _solve(LeastSquaresProblem.of(rig, table, cells, boards))
    errors = _placement_errors(table)
    scatter = placement_scatter(solution.y[errors], solution.covariance[np.ix_(errors, errors)])
    if scatter.scale > 1:
        table = table.with_wider_priors(errors, scatter.scale)
        solution, scale = _solve(LeastSquaresProblem.of(rig, table, cells, boards))
    values = table.prior_mean + table.prior_sd * solution.y
    residual, corner_residual = np.split(solution.residual_px, [len(cells.laser)])
    return CalibrationFit(
        rig=rig,
        table=table,
        cells=cells,
        rejected=name_out_of_frame(rig, values, rejected),
        values=values,
        covariance=solution.covariance * np.outer(table.prior_sd, table.prior_sd),
        prior_pull=np.where(table.prior_sd > 0, solution.y, 0.0),
        data_share=data_share(solution.jacobian, table),
        residual_px=residual,
        boards=tuple(boards),
        corner_residual_px=corner_residual,
        rms_px=_rms(cells, residual),
        noise_scale=scale,
        placement_scale=scatter.scale,
        chi2=solution.chi2,
        degrees_of_freedom=solution.degrees_of_freedom,
        converged=solution.converged,
    )


def _solve(problem: LeastSquaresProblem) -> tuple[Solution, float]:
    """The solution, and the factor on the stated noise that its residuals called for.

    Raises:
        LimitFailedError: the result is not finite.
    """
    scale = 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # a result that is not finite is refused by name
        for _ in range(10):
            solution = problem.solve(scale)
            if not solution.scale_called_for > scale * 1.001:
                break
            scale = solution.scale_called_for
    if not np.isfinite([*solution.y, *np.diag(solution.covariance), solution.chi2]).all():
        raise LimitFailedError(
            "the fit does not come to a finite result: the positions contradict the rig file altogether;"
            " check its baselines, standoffs and image size"
        )
    return solution, scale


def _placement_errors(table: ParameterTable) -> IndexArray:
    """(J,) indices of the placements' errors along the axis that are not held constant."""
    name = PLACEMENT[0]
    return np.flatnonzero(
        [p.kind == "placement" and p.name.endswith(f".{name}") and p.prior.sd > 0 for p in table.parameters]
    )


def data_share(jacobian: FloatArray, table: ParameterTable) -> FloatArray:
    """Share of each parameter's information that the data give by themselves, (P,).

    For parameter i: J_i / (J_i + 1 / prior_sd_i^2), where J_i is the information on i in the data when no
    other parameter of the sensor has a prior. A focal length that comes out sharp only because the baselines
    were measured with a calliper has a share of 0: the data fix the product, the calliper the factor. Errors
    of placement and tilt keep their priors, being the noise of the standoffs.

    Args:
        jacobian: (M, P) derivatives of the data's residuals (in sd) by the parameters (in prior sd).
        table: the parameters.
    """
    sensor = table.is_sensor
    by_sensor, by_placement = jacobian[:, sensor], jacobian[:, ~sensor]
    noise = np.eye(len(jacobian)) + by_placement @ by_placement.T
    information = by_sensor.T @ np.linalg.solve(noise, by_sensor)
    share = np.zeros(len(sensor))
    share[sensor] = np.where(table.prior_sd[sensor] > 0, share_of(information), 0.0)
    return share


def share_of(information: FloatArray) -> FloatArray:
    """(..., F) `data_share` by the data's information (..., F, F), in units of the priors."""
    # Every prior widened to (almost) none; the parameter's own is then put back by the formula.
    flat = np.linalg.inv(information + np.eye(information.shape[-1]) / FLAT_PRIOR_SD**2)
    return np.asarray(1.0 / (1.0 + np.diagonal(flat, axis1=-2, axis2=-1)))


def table_of(
    rig: Rig, placements: Sequence[PlacementInfo], boards: Sequence[BoardView] = ()
) -> ParameterTable:
    """All parameters of a fit, in the order of `Layout`: the rig's priors, then the captures'."""
    nuisances = placement_parameters(rig, [p.key for p in placements])
    told = {p.key: p for p in placements}
    flat = tuple(_as_told(n, told) for n in nuisances)
    if not boards:
        return ParameterTable((*sensor_parameters(rig), *flat))
    printed = tuple(sensor_parameter(name, getattr(rig.bench, name)) for name in PRINT)
    poses = {view.placement.key: guess_pose(rig, view) for view in boards}
    return ParameterTable(
        (
            *sensor_parameters(rig),
            *printed,
            *(_as_guessed(parameter, poses) for parameter in flat),
            *board_parameters(rig),
            *(_pose_parameter(key, name, pose) for key, pose in poses.items() for name in POSE),
        )
    )


def _as_guessed(parameter: Parameter, poses: dict[str, PoseGuess]) -> Parameter:
    """A placement's parameter, its tilt by the board where there is one."""
    key, _, name = parameter.name.rpartition(".")
    return _pose_parameter(key, name, poses[key]) if key in poses and name in POSE_SD else parameter


def _pose_parameter(key: str, name: str, pose: PoseGuess) -> Parameter:
    prior = Prior(value=getattr(pose, name.removeprefix("board_")), sd=POSE_SD[name])
    return Parameter(f"{key}.{name}", unit_of(name), prior, "placement")


def _as_told(parameter: Parameter, told: dict[str, PlacementInfo]) -> Parameter:
    """A placement's parameter with what the captures state of it in the place of the rig's prior."""
    key, _, name = parameter.name.rpartition(".")
    info = told[key]
    if name == "error_mm" and np.isfinite(info.standoff_sd_mm):
        return replace(parameter, prior=Prior(value=0.0, sd=info.standoff_sd_mm))
    if name == "slope_x" and info.yaw_deg:
        slope = tan(radians(info.yaw_deg))
        # d tan(a) = (1 + tan^2 a) da: far from square the same tilt changes the slope more.
        return replace(parameter, prior=Prior(value=slope, sd=parameter.prior.sd * (1 + slope**2)))
    return parameter


def _rms(cells: MeanObservations, residual_px: FloatArray) -> float:
    """Root mean square of measured - predicted over every single coordinate."""
    predicted = cells.position_px - residual_px
    single = [positions(m) - p for m, p in zip(cells.members, predicted, strict=True)]
    return float(np.sqrt(np.nanmean(np.concatenate(single) ** 2)))


def _check(rig: Rig, observations: Sequence[Observation]) -> None:
    if not observations:
        raise BadInputError("no spot is left to fit: expected captures with a known standoff and a spot each")
    for s in observations:
        if s.laser_id not in rig.laser_ids:
            raise BadInputError(
                f"{s.source}: laser_id: expected one of {', '.join(rig.laser_ids)} (rig {rig.rig}),"
                f" got {s.laser_id}"
            )
        depth_mm = s.standoff_mm * (1 + rig.bench.ruler_scale.value) + rig.bench.offset_mm.value
        if not depth_mm > 0:
            raise BadInputError(
                f"{s.source}: standoff_mm: expected a target before the pinhole, got {s.standoff_mm:g} mm,"
                f" which rig {rig.rig} puts at a depth of {depth_mm:g} mm; check bench.offset_mm"
            )
