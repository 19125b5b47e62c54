"""Maximum a posteriori fit of a calibration by non-linear least squares, with its covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, radians, tan

import numpy as np

from workbench.calibration.checks.out_of_frame import name_out_of_frame
from workbench.calibration.data.boards import BoardView, guess_pose, with_placements
from workbench.calibration.data.observations import (
    MeanObservations,
    Observation,
    PlacementInfo,
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
    STEP,
    Parameter,
    ParameterTable,
    board_parameters,
    placement_parameters,
    sensor_parameter,
    sensor_parameters,
    step_parameters,
    unit_of,
)
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import TermSummary
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.fit_event import Rejected
from workbench.model.prior import Prior
from workbench.model.rig import Rig
from workbench.sensor.curves import SpotCurves

POSE_SD = {"slope_x": 1.0, "slope_y": 1.0, "board_x_mm": 100.0, "board_y_mm": 100.0, "board_roll_rad": 1.0}
"""Priors of a board's pose about its starting value: far wider than the error of that value."""
FLAT_PRIOR_SD = 1e3
"""Factor on a prior's sd that makes the prior negligible."""
WHOLE = np.array([[-0.5, 0.5]])
"""Running time at the first and at the last capture of a session."""
MAX_SCALE_ROUNDS = 10
SCALE_TOLERANCE = 1.001
"""The noise scale has converged where the residuals ask for less than this factor more."""


@dataclass(frozen=True)
class CalibrationFit:
    """A fitted calibration: P parameters (sensor first), N cells, K corners of boards; sd are 1 sigma."""

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
    """Over all single positions of the used spots, not over the means."""
    noise_scale: float
    """Factor on the stated pixel noise, estimated from the residuals; 1 where they agree with it."""
    placement_scale: float
    """Factor on the stated deviations of placements, estimated from their errors; 1 likewise."""
    placement_freedom: float
    """Degrees of freedom of that estimate; infinite where the factor is 1."""
    placement_scatter_p: float
    """P value of the placement errors under their stated deviations."""
    chi2: float
    """Of the data at the stated noise."""
    degrees_of_freedom: float
    """Number of data minus the effective number of parameters that they determine."""
    converged: bool
    terms: tuple[TermSummary, ...] = ()
    """Evidence for the terms of the model (`selection.model_terms.fit_calibration`)."""

    @property
    def sd(self) -> FloatArray:
        """(P,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def noise_freedom(self) -> float:
        """Degrees of freedom of the spots' noise: of what scales it, else infinite."""
        if self.noise_scale > 1:
            return self.degrees_of_freedom
        return self.cells.repeat_freedom if self.cells.repeat_scale > 1 else inf

    @cached_property
    def layout(self) -> Layout:
        """Layout of the P parameters."""
        return layout_of(self.rig, self.cells, self.boards)

    @cached_property
    def curves(self) -> SpotCurves:
        """Spot curves of the lasers, by the fitted lens and rays."""
        layout = self.layout
        rays = self.values[layout.rays].reshape(layout.lasers, -1)
        return SpotCurves(layout.model, self.values[layout.lens], rays)

    @property
    def drift_px(self) -> FloatArray:
        """(2,) largest change of the image in u and v over the session; 0 where no drift is fitted.

        By drift and steps: positive where the larger coordinate is the later one. Without interruption it
        is the shift from the first capture to the last.
        """
        layout = self.layout
        drift = np.where(self.table.prior_sd[layout.drift] > 0, self.values[layout.drift], 0.0)
        offsets = layout.offsets_by_step @ self.values[layout.steps].reshape(-1, len(STEP))
        limits = self.cells.times.limits if layout.parts > 1 else WHOLE
        course = (limits[:, :, None] * drift + offsets[:, None]).reshape(-1, 2)
        sign = np.where(course.argmax(axis=0) >= course.argmin(axis=0), 1.0, -1.0)
        return np.asarray(sign * np.ptp(course, axis=0), np.float64)

    @property
    def corner_rms_px(self) -> float:
        """Root mean square residual of all corners; NaN without boards."""
        corners = self.corner_residual_px
        return float(np.sqrt(np.mean(corners**2))) if corners.size else float("nan")

    @cached_property
    def used(self) -> tuple[Observation, ...]:
        """All observations that the fit uses."""
        return tuple(s for members in self.cells.members for s in members)

    @property
    def sensor(self) -> slice:
        """Indices of the sensor's parameters."""
        return self.layout.sensor


def fit(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """Fit the rig's parameters to observations of a flat target, and to views of the printed board.

    The estimate maximises the posterior, with Gaussian noise and the rig's Gaussian priors. Errors and
    tilts of the placements are parameters with priors, so that repeats at one placement share them. Where
    the residuals are significantly larger than the stated noise, the noise is scaled to them and the fit
    repeated. The degrees of freedom are the coordinates less the effective number of parameters.

    Args:
        rig: priors and noise.
        observations: spots at known standoffs.
        rejected: earlier rejections, to be listed with those of the fit.
        boards: views of the board, one for each placement with the board as its target.

    Raises:
        BadInputError: no observations, an unknown laser, a placement with two settings, or a target behind
            the pinhole.
        LimitFailedError: the result is not finite.
    """
    _check(rig, observations)
    cells, outliers = group(observations, rig.laser_ids, rig.noise)
    if not cells.placements:
        raise BadInputError(
            f"no spot is left to fit: all {len(outliers)} observations lie apart from their repeats,"
            f" such as {outliers[0].reason} ({outliers[0].source})"
        )
    return fit_cells(rig, with_placements(cells, boards), (*rejected, *outliers), boards)


def fit_cells(
    rig: Rig, cells: MeanObservations, rejected: Sequence[Rejected] = (), boards: Sequence[BoardView] = ()
) -> CalibrationFit:
    """`fit` of mean observations, with the boards' placements among theirs.

    Raises:
        LimitFailedError: the result is not finite.
    """
    table = table_of(rig, cells.placements, boards, layout_of(rig, cells, boards).parts)
    solution, scale = _solve(LeastSquaresProblem.of(rig, table, cells, boards))
    errors = _placement_errors(table, {p.key for p in cells.placements if p.is_free})
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
        placement_freedom=scatter.degrees_of_freedom,
        placement_scatter_p=scatter.p_value,
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
    with np.errstate(over="ignore", invalid="ignore"):  # a result that is not finite raises below
        for _ in range(MAX_SCALE_ROUNDS):
            solution = problem.solve(scale)
            if not solution.significant_scale > scale * SCALE_TOLERANCE:
                break
            scale = solution.significant_scale
    if not np.isfinite([*solution.y, *np.diag(solution.covariance), solution.chi2]).all():
        raise LimitFailedError(
            "the fit has no finite result: the positions contradict the rig file; check its baselines,"
            " standoffs and image size"
        )
    return solution, scale


def _placement_errors(table: ParameterTable, free: Set[str]) -> IndexArray:
    """(J,) indices of the placements' errors along the axis that are not held constant.

    Args:
        table: parameters of the fit.
        free: placements without a stated standoff, which can have no error.
    """
    parts = [(p, *p.name.rpartition(".")) for p in table.parameters]
    return np.flatnonzero(
        [
            p.kind == "placement" and name == PLACEMENT[0] and p.prior.sd > 0 and key not in free
            for p, key, _, name in parts
        ]
    )


def data_share(jacobian: FloatArray, table: ParameterTable) -> FloatArray:
    """Information share of the data in each parameter, (P,).

    For parameter i: J_i / (J_i + 1 / prior_sd_i^2), where J_i is the information of the data on i when no
    other parameter of the sensor has a prior. A focal length that is determined only together with measured
    baselines has a share of 0: the data determine the product f b alone. Errors and tilts of the placements
    keep their priors, which are the noise of the standoffs.

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
    """(..., F) `data_share` from the information of the data (..., F, F), in units of the priors."""
    # All priors are made negligible; the formula adds the parameter's own prior.
    flat = np.linalg.inv(information + np.eye(information.shape[-1]) / FLAT_PRIOR_SD**2)
    return np.asarray(1.0 / (1.0 + np.diagonal(flat, axis1=-2, axis2=-1)))


def table_of(
    rig: Rig, placements: Sequence[PlacementInfo], boards: Sequence[BoardView] = (), parts: int = 1
) -> ParameterTable:
    """All parameters of a fit, in the order of `Layout`, with the priors of the rig and of the captures."""
    nuisances = placement_parameters(rig, [p.key for p in placements])
    by_key = {p.key: p for p in placements}
    flat = tuple(_with_stated_prior(n, by_key) for n in nuisances)
    if not boards:
        return ParameterTable((*sensor_parameters(rig), *flat, *step_parameters(parts)))
    printed = tuple(sensor_parameter(name, getattr(rig.bench, name)) for name in PRINT)
    poses = {view.placement.key: _pose_priors(rig, view) for view in boards}
    return ParameterTable(
        (
            *sensor_parameters(rig),
            *printed,
            *(_with_pose_prior(parameter, poses) for parameter in flat),
            *board_parameters(rig),
            *(
                Parameter(f"{key}.{name}", unit_of(name), priors[name], "placement")
                for key, priors in poses.items()
                for name in POSE
            ),
            *step_parameters(parts),
        )
    )


def _with_pose_prior(parameter: Parameter, poses: Mapping[str, Mapping[str, Prior]]) -> Parameter:
    """A placement's parameter, with the prior of a board's pose if it has one."""
    key, _, name = parameter.name.rpartition(".")
    return replace(parameter, prior=poses.get(key, {}).get(name, parameter.prior))


def _pose_priors(rig: Rig, view: BoardView) -> dict[str, Prior]:
    """Wide priors of a board's pose about its starting value, by the names of the placement's parameters.

    Slopes, position and rotation; for a board held anywhere also its depth, instead of the error of a stated
    standoff.
    """
    pose = guess_pose(rig, view)
    priors = {
        name: Prior(value=getattr(pose, name.removeprefix("board_")), sd=sd) for name, sd in POSE_SD.items()
    }
    if view.placement.is_free:
        depth_mm = pose.z0_mm - rig.bench.offset_mm.value
        priors |= {
            PLACEMENT[0]: Prior(value=depth_mm, sd=pose.distance_mm),
            "board_x_mm": Prior(value=pose.x_mm, sd=pose.distance_mm),
            "board_y_mm": Prior(value=pose.y_mm, sd=pose.distance_mm),
        }
    return priors


def _with_stated_prior(parameter: Parameter, placements: dict[str, PlacementInfo]) -> Parameter:
    """A placement's parameter; sd and yaw that the captures state replace the rig's prior."""
    key, _, name = parameter.name.rpartition(".")
    info = placements[key]
    if name == "error_mm" and np.isfinite(info.standoff_sd_mm):
        return replace(parameter, prior=Prior(value=0.0, sd=info.standoff_sd_mm))
    if name == "slope_x" and info.yaw_deg:
        slope = tan(radians(info.yaw_deg))
        # d tan(a) = (1 + tan^2 a) da: the same uncertainty of the tilt is a larger one of the slope.
        return replace(parameter, prior=Prior(value=slope, sd=parameter.prior.sd * (1 + slope**2)))
    return parameter


def _rms(cells: MeanObservations, residual_px: FloatArray) -> float:
    """Root mean square residual over the coordinates of all single observations, px."""
    predicted = cells.position_px - residual_px
    single = [positions(m) - p for m, p in zip(cells.members, predicted, strict=True)]
    if not single:
        return float("nan")
    return float(np.sqrt(np.nanmean(np.concatenate(single) ** 2)))


def _check(rig: Rig, observations: Sequence[Observation]) -> None:
    if not observations:
        raise BadInputError("no observations to fit: expected captures with a known standoff and one spot")
    known, scale, offset_mm = set(rig.laser_ids), 1 + rig.bench.ruler_scale.value, rig.bench.offset_mm.value
    for s in observations:
        if s.laser_id not in known:
            raise BadInputError(
                f"{s.source}: laser_id: expected one of {', '.join(rig.laser_ids)} (rig {rig.rig}),"
                f" got {s.laser_id}"
            )
        depth_mm = s.standoff_mm * scale + offset_mm
        if not depth_mm > 0:
            raise BadInputError(
                f"{s.source}: standoff_mm: expected a target in front of the pinhole, got"
                f" {s.standoff_mm:g} mm, a depth of {depth_mm:g} mm by rig {rig.rig}; check bench.offset_mm"
            )
