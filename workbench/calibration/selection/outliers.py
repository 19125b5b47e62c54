"""Fit without outliers: spots are tested and rejected at a stated false-rejection rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.checks.target_motion import find_target_motion
from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation, RejectedObservation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig


def fit_without_outliers(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """`fit`, then `without_outliers`."""
    return without_outliers(fit(rig, observations, rejected, boards), rejected)


def without_outliers(found: CalibrationFit, rejected: Sequence[Rejected]) -> CalibrationFit:
    """The fit repeated without its outliers, if there are any.

    A spot is the mean of its repeats, which share its error. It is rejected where its distance from the
    prediction by all others is significant at a rate of 1 in 1000 fits. No other hypothesis (lasers
    exchanged, a wrong standoff, target motion) may explain it better.

    Args:
        found: a fit of all observations.
        rejected: rejections before that fit; they are listed together with the outliers.

    Raises:
        LimitFailedError: as `fit`.
    """
    outliers = [h.subject[0] for h in explain_misfit(found) if h.kind == "spot"]
    suspects = sorted({int(found.cells.placement[cell]) for cell in outliers})
    moved = [motion.placement for motion in find_target_motion(found, suspects)]
    outliers = [
        cell
        for cell in outliers
        if (at := found.cells.placement[cell]) not in moved and not _is_most(found, at, outliers)
    ]
    if not outliers:
        return found
    reasons = {s.source: _reason(found, cell) for cell in outliers for s in found.cells.members[cell]}
    observations = found.cells.captures
    removed = [
        RejectedObservation(s.source, reasons[s.source], s) for s in observations if s.source in reasons
    ]
    kept = [s for s in observations if s.source not in reasons]
    return fit(found.rig, kept, [*rejected, *removed], found.boards)


def _is_most(found: CalibrationFit, placement: int, outliers: Sequence[int]) -> bool:
    """Whether half or more of a placement's spots are outliers: then the placement itself is wrong."""
    here = found.cells.placement == placement
    return 2 * int(here[list(outliers)].sum()) >= int(here.sum()) > 1


def _reason(found: CalibrationFit, cell: int) -> str:
    laser = found.rig.laser_ids[found.cells.laser[cell]]
    standoff = found.cells.placements[found.cells.placement[cell]].standoff_mm
    off = np.nan_to_num(found.residual_px[cell])
    return (
        f"laser {laser} at {standoff:g} mm: outlier, its spot contradicts all others"
        f" (residual {off[0]:+.2f}, {off[1]:+.2f} px of the fit with it)"
    )
