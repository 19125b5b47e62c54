"""Step `fit`: fit the calibration to the captures so far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from workbench.model.acceptance import Acceptance
from workbench.model.captures import BOARD
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.event import CaptureTaken, FitFinished
from workbench.model.number_text import counted
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.session.capture_table import CALIBRATION_TABLE, first_time_ns, write_capture_table


@register
class FitStep(StepModel):
    """Fit the calibration to the captures so far; a failed limit ends the session with exit code 3."""

    needs: ClassVar[str | None] = "captures"
    gives: ClassVar[str | None] = "fit"
    step: Literal["fit"]
    limits: Acceptance = Acceptance()

    @property
    def title(self) -> str:
        """Description of the step."""
        return "Fit the calibration"

    def run(self, context: Context, name: str) -> str:
        """Write captures.csv, fit, journal the fit.

        Raises:
            BadInputError: there are no captures.
            LimitFailedError: the calibration is refused.
        """
        from workbench.calibration.data.boards import BoardView, on_boards
        from workbench.calibration.data.observations import Observation
        from workbench.calibration.selection.model_terms import fit_calibration
        from workbench.calibration.verdict.export import accept_with_reason, calibrate
        from workbench.calibration.verdict.records import fit_finished
        from workbench.model.fit_event import Rejected
        from workbench.procedure.engine.observed import observe_capture

        # In the order of time, which a drift follows: after a repair it is not that of the procedure.
        captures = sorted(
            (c for c in context.captures if c.purpose == "calibration"),
            key=lambda one: (one.part, one.time_ns),
        )
        if not captures:
            raise BadInputError(f"step {name}: no captures to fit; expected a capture_grid step before it")
        sha256 = write_capture_table(context.session_dir / CALIBRATION_TABLE, captures)
        zero_ns = first_time_ns(captures)
        spots = [observe_capture(context, one, zero_ns) for one in captures if one.laser_id != BOARD]
        found = on_boards(context.rig.board, context.boards, spots)
        observations = [f for f in found if isinstance(f, Observation)]
        rejected = [f for f in (*found, *context.boards.values()) if isinstance(f, Rejected)]
        boards = [b for b in context.boards.values() if isinstance(b, BoardView)]
        fitted = fit_calibration(context.rig, observations, rejected, boards)
        provenance = context.provenance.model_copy(update={"captures_sha256": sha256})
        notes = _skipped_notes(_planned(context, name), captures, [one.standoff_mm for one in fitted.used])
        calibration, assessment = calibrate(fitted, self.limits, provenance, notes)
        finished = fit_finished(fitted, assessment)
        context.emit(finished)
        because = context.recorder.repairs.accepted_because
        if assessment.verdict == "refused" and because is not None:
            calibration = accept_with_reason(calibration, because)
            notes = [*notes, f"accepted although {'; '.join(assessment.reasons)}, because: {because}"]
        elif assessment.verdict == "refused":
            raise LimitFailedError(_refusal(finished))
        context.accepted, context.cross_validation = calibration, assessment.cross_validation
        worst = calibration.laser_ranger.validity.max_relative_range_sd
        return (
            f"accepted: rms {fitted.rms_px:.3f} px over {counted(len(observations), 'spot')},"
            f" {len(fitted.rejected)} rejected; range uncertainty at most {100 * worst:.2g} % (1 sigma)"
            + "".join(f"; {note}" for note in notes)
        )


def _refusal(fit: FitFinished) -> str:
    """Reasons of a refusal, and the options of `workbench repair` for the suspected placements."""
    options = "; ".join(f"repair --recapture {key}, or repair --leave-out {key}" for key in fit.suspects)
    return f"the calibration is refused: {'; '.join(fit.reasons)}" + (f" ({options})" if options else "")


def _planned(context: Context, name: str) -> list[Placement]:
    """Placements of the procedure's steps that give captures, before the step `name`."""
    procedure = name.rpartition(".")[0]
    steps = enumerate(context.steps[: context.step_index], start=1)
    return [
        placement
        for number, step in steps
        if step.gives == "captures"
        for placement in step.placements(f"{procedure}.{number}", context.rig)
    ]


def _skipped_notes(
    planned: Sequence[Placement], captures: Sequence[CaptureTaken], used_mm: Sequence[float]
) -> list[str]:
    """Note on skipped placements and on the validity without them.

    Args:
        planned: placements of the procedure.
        captures: captures of the calibration.
        used_mm: standoffs of the observations in the fit.
    """
    visited = {capture.placement_key for capture in captures}
    skipped = [placement.standoff_mm for placement in planned if placement.key not in visited]
    if not skipped:
        return []
    at = ", ".join(f"{standoff:g}" for standoff in skipped)
    valid, all_mm = (min(used_mm), max(used_mm)), [placement.standoff_mm for placement in planned]
    narrowed = valid[0] > min(all_mm) or valid[1] < max(all_mm)
    instead = f", the procedure's placements from {min(all_mm):g} to {max(all_mm):g} mm" if narrowed else ""
    return [
        f"{counted(len(skipped), 'placement')} skipped (at {at} mm): the calibration is valid from"
        f" {valid[0]:g} to {valid[1]:g} mm{instead}"
    ]
