"""Verdict on the fit of a camera alone, and its file."""

from __future__ import annotations

from workbench.calibration.checks.board_views import FEWEST_VIEWS, suspect_notes, view_residuals
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.assessment import determined_by
from workbench.calibration.verdict.camera_info import camera_info, parameters
from workbench.calibration.verdict.yaml_text import yaml_text
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Provenance
from workbench.model.camera_file import (
    CameraBlock,
    CameraCalibration,
    CameraFitSummary,
    ViewQuality,
)
from workbench.model.number_text import counted

LARGEST_F_SD = 0.01
"""Largest relative deviation of the focal length: views of one tilt leave it open."""


def calibrate_camera(fit: CalibrationFit, provenance: Provenance) -> CameraCalibration:
    """Make the calibration of a fit of a camera alone, with its verdict."""
    reasons = _reasons(fit)
    return CameraCalibration(
        **camera_info(fit).model_dump(),
        workbench_camera=CameraBlock(
            format=1,
            parameters=parameters(fit, fit.layout.lens),
            fit=CameraFitSummary(
                rms_px=fit.corner_rms_px,
                noise_scale=fit.noise_scale,
                verdict="refused" if reasons else "accepted",
                reasons=tuple(reasons),
                warnings=tuple(_warnings(fit)),
                views=tuple(
                    ViewQuality(
                        name=view.name, corners=view.corners, rms_px=view.rms_px, suspect=view.is_suspect
                    )
                    for view in view_residuals(fit)
                ),
            ),
            provenance=provenance,
        ),
    )


def render_camera(calibration: CameraCalibration) -> str:
    """The YAML text."""
    return yaml_text(calibration.model_dump())


def _reasons(fit: CalibrationFit) -> list[str]:
    """Reasons for a refusal."""
    limits, views = Acceptance(), len(fit.boards)
    reasons = []
    if views < FEWEST_VIEWS:
        reasons.append(
            f"{counted(views, 'view')} of the board, expected at least {FEWEST_VIEWS}. Do: add views with"
            " tilts of some 30 degrees each way about both axes"
        )
    if not fit.converged:
        reasons.append("the solver did not converge. Do: check camera.f_px and the board in the rig file")
    if not fit.corner_rms_px <= limits.max_rms_px:
        reasons.append(
            f"residual rms {fit.corner_rms_px:.2f} px, expected at most {limits.max_rms_px:g} px. Do: check"
            " the board in the rig file, and leave out views that are named"
        )
    relative = float(fit.sd[0] / fit.values[0])
    if not relative <= LARGEST_F_SD:
        reasons.append(
            f"relative standard deviation of the focal length {100 * relative:.2g} %, expected at most"
            f" {100 * LARGEST_F_SD:g} %. Do: add views with tilts of some 30 degrees each way about both axes"
        )
    return reasons


def _warnings(fit: CalibrationFit) -> list[str]:
    lens = fit.layout.lens
    names = [p.name for p in fit.table.parameters[lens]]
    known = zip(names, determined_by(fit)[lens], fit.table.prior_sd[lens].tolist(), strict=True)
    prior = [name for name, by, sd in known if by == "prior" and sd > 0]
    warnings = suspect_notes(view_residuals(fit))
    if prior:
        warnings.append(f"not constrained by these views, the rig file's prior is used: {', '.join(prior)}.")
    warnings += [
        f"the data call for {term.name} (p {term.p_value:.1g}), which the rig file holds constant."
        " Give it an sd in the rig file."
        for term in fit.terms
    ]
    if fit.noise_scale > 1:
        warnings.append(
            f"corners scatter {fit.noise_scale:.2f} times more than their pixels show; every sd is scaled by"
            " this factor."
        )
    return warnings
