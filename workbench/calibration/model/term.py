"""What the data say of a part of the model that may not be needed."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.calibration import TermVerdict


@dataclass(frozen=True)
class Term:
    """A term of the model, compared with its absence: its parameters at the rig file's values."""

    name: str
    """`k2`, `p1 p2`, `ruler_scale`, or `tilts` (of all placements together)."""
    p_value: float
    """Of what the data show, were the term absent; its own prior takes no part."""
    log10_bayes_factor: float
    """For the model with the term, by its prior, over the model without."""
    range_shift_sd: float | None
    """Largest change of a range without it, in deviations of that range. None: the model lacks it."""
    verdict: TermVerdict
