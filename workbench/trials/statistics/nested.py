"""Mean squares of readings in placements, nested in sessions, also with unequal numbers.

Source: Searle, Casella and McCulloch, Variance Components (1992), expected mean squares of nested designs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from workbench.model.arrays import FloatArray, IndexArray
from workbench.trials.statistics.estimate import require


@dataclass(frozen=True)
class NestedSquares:
    """Mean squares (unit of the readings squared), degrees of freedom and effective group sizes.

    Expectations, with the variances of readings e, placements p and sessions s:
    `within`: e; `placement`: e + placement_size p;
    `session`: e + session_placement_size p + session_size s.
    """

    within: float
    within_dof: int
    placement: float
    placement_dof: int
    placement_size: float
    readings: int
    placements: int
    sessions: int
    session: float | None = None
    """None with one session."""
    session_dof: int = 0
    session_placement_size: float = 0.0
    session_size: float = 1.0

    def total_variance(self) -> tuple[list[float], list[float], list[float]]:
        """Weights, mean squares and degrees of freedom whose sum estimates e + p + s; readings come last."""
        upper = 0.0 if self.session is None else 1 / self.session_size
        middle = (1 - upper * self.session_placement_size) / self.placement_size
        lower = 1 - upper - middle
        weights = [upper, max(0.0, middle), max(0.0, lower)]
        values = [self.session or 0.0, self.placement, self.within]
        dofs = [float(self.session_dof), float(self.placement_dof), float(self.within_dof)]
        used = [index for index in (0, 1, 2) if index or self.session is not None]
        return [weights[i] for i in used], [values[i] for i in used], [dofs[i] for i in used]


def nested_squares(readings: pd.DataFrame) -> NestedSquares:
    """Mean squares of readings.

    Args:
        readings: one row a reading with `error_mm` (without gaps), `placement` and, optionally, `session`.
            Equal labels of placements in different sessions are different placements.

    Raises:
        TooFewReadingsError: fewer than two placements in one session, or one reading at each.
    """
    require(len(readings), 2, "readings")
    cells, session_of_cell = _numbered(readings)
    error = readings["error_mm"].to_numpy(np.float64)
    sizes, means = _sizes_and_means(cells, error)
    session_sizes, session_means = _sizes_and_means(session_of_cell[cells], error)
    sessions, total = len(session_sizes), len(error)
    require(len(sizes) - sessions + 1, 2, "placements in one session")
    require(total - len(sizes) + 1, 2, "readings at one placement")
    residuals = error - means[cells]
    shared = float((sizes**2 / session_sizes[session_of_cell]).sum())
    found = NestedSquares(
        within=float(residuals @ residuals) / (total - len(sizes)),
        within_dof=total - len(sizes),
        placement=float(sizes @ (means - session_means[session_of_cell]) ** 2) / (len(sizes) - sessions),
        placement_dof=len(sizes) - sessions,
        placement_size=(total - shared) / (len(sizes) - sessions),
        readings=total,
        placements=len(sizes),
        sessions=sessions,
    )
    if sessions == 1:
        return found
    return replace(
        found,
        session=float(session_sizes @ (session_means - error.mean()) ** 2) / (sessions - 1),
        session_dof=sessions - 1,
        session_placement_size=(shared - float(sizes @ sizes) / total) / (sessions - 1),
        session_size=(total - float(session_sizes @ session_sizes) / total) / (sessions - 1),
    )


def _numbered(readings: pd.DataFrame) -> tuple[IndexArray, IndexArray]:
    """Number of the placement of each reading (n,), and of the session of each placement (p,)."""
    placement = pd.factorize(readings["placement"])[0]
    if "session" not in readings:
        return placement, np.zeros(int(placement.max()) + 1, np.intp)
    session = pd.factorize(readings["session"])[0]
    _, firsts, numbers = np.unique(
        session * (int(placement.max()) + 1) + placement, return_index=True, return_inverse=True
    )
    return numbers, session[firsts]


def _sizes_and_means(groups: IndexArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    sizes = np.bincount(groups).astype(np.float64)
    return sizes, np.bincount(groups, values) / sizes
