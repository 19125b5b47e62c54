"""The fit without what is no spot of its laser: test and reject, at a stated rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.checks.target_motion import find_target_motion
from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation, Rejected
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.model.rig import Rig


def fit_without_outliers(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """As `fit`, and then `without_outliers`."""
    return without_outliers(fit(rig, observations, rejected, boards), rejected)


def without_outliers(found: CalibrationFit, rejected: Sequence[Rejected]) -> CalibrationFit:
    """The fit, repeated without the spots that lie apart from where all the others put them if there are any.

    A spot is the mean of its repeats: they share what is wrong with it. It is rejected where its distance is
    what one sound fit in 1000 shows in any of its spots, and where no other account (lasers exchanged, a
    standoff mistyped, a target that moved) explains it better; its captures are
    listed with the fit's own rejections.

    Args:
        found: a fit of everything.
        rejected: what was already rejected before that fit.

    Raises:
        LimitFailedError: as `fit`.
    """
    outliers = [h.subject[0] for h in explain_misfit(found) if h.kind == "spot"]
    suspects = sorted({int(found.cells.placement[cell]) for cell in outliers})
    moved = [movement.placement for movement in find_target_motion(found, suspects)]
    outliers = [
        cell
        for cell in outliers
        if (at := found.cells.placement[cell]) not in moved and not _is_most(found, at, outliers)
    ]
    if not outliers:
        return found
    apart = {s.source: _reason(found, cell) for cell in outliers for s in found.cells.members[cell]}
    observations = found.cells.captures
    strays = [Rejected(s.source, apart[s.source], stray=s) for s in observations if s.source in apart]
    kept = [s for s in observations if s.source not in apart]
    return fit(found.rig, kept, [*rejected, *strays], found.boards)


def _is_most(found: CalibrationFit, placement: int, outliers: Sequence[int]) -> bool:
    """Whether half the spots of a placement lie apart: then it is the placement that is wrong."""
    of_it = found.cells.placement == placement
    return 2 * int(of_it[list(outliers)].sum()) >= int(of_it.sum()) > 1


def _reason(found: CalibrationFit, cell: int) -> str:
    laser = found.rig.laser_ids[found.cells.laser[cell]]
    standoff = found.cells.placements[found.cells.placement[cell]].standoff_mm
    off = np.nan_to_num(found.residual_px[cell])
    return (
        f"laser {laser} at {standoff:g} mm: its spot lies apart from where all others put it"
        f" ({off[0]:+.2f}, {off[1]:+.2f} px from the fit that it took part in)"
    )
