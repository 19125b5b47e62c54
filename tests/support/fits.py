"""Records of fits with stated verdicts, for tests of what follows them."""

from __future__ import annotations

from workbench.model.fit_event import CrossValidatedPlacement, Fault, FitFinished


def cross_validated(
    placement: str, standoff_mm: float, error_mm: float, alarm: bool = False
) -> CrossValidatedPlacement:
    return CrossValidatedPlacement(
        placement=placement,
        standoff_mm=standoff_mm,
        error_mm=error_mm,
        sd_mm=1.0,
        lasers=(),
        alarm=alarm,
    )


def fitted(
    *reasons: str,
    left_out: tuple[CrossValidatedPlacement, ...] = (),
    faults: tuple[Fault, ...] = (),
    needs_standoffs: bool = False,
) -> FitFinished:
    """Fit that is refused for the reasons, or accepted without any."""
    return FitFinished(
        parameters=(),
        residuals=(),
        rms_px=0.1,
        observations=4,
        rejected=(),
        verdict="refused" if reasons else "accepted",
        reasons=reasons,
        warnings=("cx_px is fixed. Its prior is used.",),
        left_out=left_out,
        faults=faults,
        needs_standoffs=needs_standoffs,
    )
