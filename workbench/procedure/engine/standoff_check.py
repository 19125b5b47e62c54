"""Comparison of a standoff with its prediction while the target still stands there."""

from __future__ import annotations

from math import isfinite

from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import settle
from workbench.procedure.engine.prompts import standoff_prompt


def check_standoff(context: Context, placement: Placement, planned: int) -> None:
    """Ask about a placement whose spots contradict its standoff, by the other placements of the session.

    A replayed placement is not asked about, because the target has moved on; the fit names it.

    Args:
        context: session; the placement is captured.
        placement: placement as entered.
        planned: number of placements before the next fit.

    Raises:
        RetakeError: the target must be placed and captured again.
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
    """
    # Imported here: checking a file must not import the solver.
    from workbench.calibration.design.latest_standoff import latest_standoff
    from workbench.procedure.engine.observed import observed_so_far

    found = latest_standoff(context.rig, observed_so_far(context), placement.key, planned)
    if found is None or not found.contradicts:
        return
    here = f"{placement.standoff_mm:g} mm"
    fits = (
        f"fit a standoff of {placement.standoff_mm + found.error_mm:.1f} +- {found.sd_mm:.1f} mm"
        if isfinite(found.error_mm)
        else "fit no standoff"
    )
    failed = f"The spots at {here} {fits}, by the {found.earlier} other placements."
    prompt = standoff_prompt(placement, failed)
    if context.pairs.replayed is not None and context.recorder.answer(prompt.key) is None:
        return
    settle(context, prompt, failed, place_again=True)
