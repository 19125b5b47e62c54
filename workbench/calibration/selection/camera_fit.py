"""Fit of a camera alone, to views of a board held anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.calibration.data.boards import BoardView, with_placements
from workbench.calibration.data.observations import group
from workbench.calibration.estimation.fit import CalibrationFit, fit_cells
from workbench.calibration.selection.missing_terms import missing_terms
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.rig import Rig


def fit_camera(rig: Rig, boards: Sequence[BoardView], rejected: Sequence[Rejected] = ()) -> CalibrationFit:
    """Fit the rig's lens to views of its board; the rig's lasers take no part.

    Args:
        rig: priors of the lens, and the board.
        boards: views of the board.
        rejected: views in which it was not found, for the record.

    Returns:
        The fit, with the constant lens terms that the data call for in `terms`.

    Raises:
        BadInputError: no views, or no pose of the board fits a view.
        LimitFailedError: the result is not finite.
    """
    if not boards:
        raise BadInputError("no view of the board to fit; check board in the rig file, and the images")
    alone = rig.model_copy(update={"lasers": ()})
    cells, _ = group((), (), rig.noise)
    fitted = fit_cells(alone, with_placements(cells, boards), rejected, boards)
    return replace(fitted, terms=tuple(missing_terms(fitted)))


def with_scatter_of_views(rig: Rig, boards: Sequence[BoardView]) -> list[BoardView]:
    """Views with the deviations that the views of a board held anywhere call for by themselves.

    Photographs compressed by a camera scatter more than their pixels show. Spots must not be taken for wrong
    for that: a fit of both has one noise scale.
    """
    free = [view for view in boards if view.placement.is_free]
    if not free:
        return list(boards)
    scale = fit_camera(rig, free).noise_scale
    return [view.with_wider_sd(scale) if view.placement.is_free else view for view in boards]
