"""Limits of the fit step, as the procedure states them, with the values of the last fit.

The journal has a record for every limit but these: the fit itself refuses a calibration that fails them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from workbench.calibration.model.parameters import DRIFT
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration
from workbench.model.event import LimitChecked, TrialFinished
from workbench.model.fit_event import FitFinished
from workbench.model.table import Cell
from workbench.report.certificate.session_record import SessionRecord

Row = tuple[Cell, Cell, Cell, Cell, Cell, Cell]
"""Step, subject, quantity, value, limit, verdict."""
VERIFIED = "errors as the calibration states them"
"""Requirement that a verification tests."""


def limit_rows(session: SessionRecord, calibration: Calibration | None) -> list[Row]:
    """One row for each decision: limits of the last fit, those of the journal, verdicts of verifications."""
    checked = session.events(LimitChecked)
    return [
        *fit_limit_rows(session, calibration),
        *((one.step, one.of, one.quantity, one.value, one.limit, one.verdict) for one in checked),
        *_verification_rows(session),
    ]


def _verification_rows(session: SessionRecord) -> Iterator[Row]:
    """Verdict of each verification, of its last run."""
    last = {one.trial: one.verification for one in session.events(TrialFinished)}
    for trial, found in last.items():
        if found is not None:
            verdict = "pass" if found.valid else "fail"
            yield trial, "calibration", found.reason or "verification", None, VERIFIED, verdict


def fit_limit_rows(session: SessionRecord, calibration: Calibration | None) -> list[Row]:
    """One row for each limit of the last fit; none without a fit, or if the procedure cannot be read."""
    found = list(_fit_steps(session))
    fit = session.fit
    if fit is None or not found:
        return []
    step, limits = found[-1]
    return [
        _row(step, "rms_px", fit.rms_px, limits.max_rms_px),
        _row(step, "relative_range_sd", _range_sd(calibration), limits.max_relative_range_sd),
        _row(step, "drift_px", _drift_px(fit), limits.max_drift_px),
        _row(step, "placement_scale", _placement_scale(calibration), limits.max_placement_scale),
        _standoffs_row(step, session, fit, limits.min_standoffs),
    ]


def _fit_steps(session: SessionRecord) -> Iterator[tuple[str, Acceptance]]:
    """Names of the fit steps with their limits, from the copies of the procedures."""
    for entry in session.manifest.procedures:
        try:
            content = YAML(typ="safe").load(entry.text)
            for index, step in enumerate(content["steps"], start=1):
                if step["step"] == "fit":
                    limits = Acceptance.model_validate(step.get("limits") or {})
                    yield f"{content['procedure']}.{index}", limits
        except (YAMLError, ValidationError, KeyError, TypeError, AttributeError):
            continue  # of another version


def _row(step: str, quantity: str, value: float | None, most: float) -> Row:
    verdict = "" if value is None else "pass" if value <= most else "fail"
    return step, "fit", quantity, value, f"at most {most:g}", verdict


def _standoffs_row(step: str, session: SessionRecord, fit: FitFinished, least: int) -> Row:
    """Fewest standoffs of a laser of the rig; none for a laser without residuals."""
    seen = {(one.laser_id, one.standoff_mm) for one in fit.residuals}
    counts = Counter(laser_id for laser_id, _ in seen)
    fewest = min(counts[laser_id] for laser_id in session.rig.laser_ids)
    verdict = "pass" if fewest >= least else "fail"
    return step, "fit", "standoffs", fewest, f"at least {least}", verdict


def _range_sd(calibration: Calibration | None) -> float | None:
    return None if calibration is None else calibration.laser_ranger.validity.max_relative_range_sd


def _placement_scale(calibration: Calibration | None) -> float | None:
    return None if calibration is None else calibration.laser_ranger.fit.placement_scale


def _drift_px(fit: FitFinished) -> float | None:
    recorded = fit.drift_px or [one.value for one in fit.parameters if one.name in DRIFT]
    return max(map(abs, recorded), default=None)
