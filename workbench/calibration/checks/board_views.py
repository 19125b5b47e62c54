"""Views of a board whose corners fit far worse than those of the others: moved, blurred, or misread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit

SUSPECT_RATIO = 3.0
"""Ratio of a view's residuals to the median of all views from which it is suspect. Sound views of one camera
differ by a factor of two, by focus, distance and light."""
FEWEST_VIEWS = 3
"""Views of which the median is typical."""


@dataclass(frozen=True)
class ViewResidual:
    """Residuals of one view of the board."""

    name: str
    """Key of its placement."""
    corners: int
    rms_px: float
    """Root mean square over both coordinates of its corners."""
    is_suspect: bool


def view_residuals(fit: CalibrationFit) -> tuple[ViewResidual, ...]:
    """Residuals of every view, in the order of the captures."""
    counts = [len(view.corners.ids) for view in fit.boards]
    parts = np.split(fit.corner_residual_px, np.cumsum(counts)[:-1]) if counts else []
    rms = [float(np.sqrt(np.mean(part**2))) for part in parts]
    limit = SUSPECT_RATIO * float(np.median(rms)) if len(rms) >= FEWEST_VIEWS else np.inf
    return tuple(
        ViewResidual(view.placement.key, count, size, size > limit)
        for view, count, size in zip(fit.boards, counts, rms, strict=True)
    )


def suspect_notes(views: Sequence[ViewResidual]) -> list[str]:
    """One note for each suspect view."""
    usual = float(np.median([view.rms_px for view in views])) if views else 0.0
    return [
        f"the view {view.name} fits far worse than the others: rms {view.rms_px:.2f} px, expected about"
        f" {usual:.2f} px. Do: look at it (moved, blurred, covered, corners misread), and leave it out"
        for view in views
        if view.is_suspect
    ]
