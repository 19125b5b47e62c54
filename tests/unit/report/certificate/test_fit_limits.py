"""Limits of the fit step with the values of the fit."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.support.reference_session import record
from workbench.model.acceptance import Acceptance
from workbench.report.certificate.fit_limits import fit_limit_rows
from workbench.report.certificate.session_record import SessionRecord


def with_procedure(old: str, new: str) -> SessionRecord:
    session = record()
    (entry,) = session.manifest.procedures
    changed = entry.model_copy(update={"text": entry.text.replace(old, new)})
    return replace(session, manifest=session.manifest.model_copy(update={"procedures": (changed,)}))


def test_every_limit_has_its_value_and_its_verdict() -> None:
    session = record()
    rows = {row[2]: row[3:] for row in fit_limit_rows(session, session.calibration)}
    assert session.fit is not None
    assert session.calibration is not None
    assert rows["rms_px"] == (session.fit.rms_px, "at most 0.5", "pass")
    assert rows["relative_range_sd"][0] == session.calibration.laser_ranger.validity.max_relative_range_sd
    assert rows["standoffs"] == (6, "at least 3", "pass")
    assert len(rows) == len(Acceptance.model_fields)


@pytest.mark.parametrize(("limit", "verdict"), [("0.02", "fail"), ("0.03", "pass")])
def test_a_value_above_its_limit_fails(limit: str, verdict: str) -> None:
    session = with_procedure("max_rms_px: 0.5", f"max_rms_px: {limit}")
    assert fit_limit_rows(session, None)[0][-1] == verdict


def test_the_drift_of_an_interrupted_session_includes_its_steps() -> None:
    session = record()
    assert session.fit is not None
    shifted = session.fit.model_copy(update={"drift_px": (0.3, -1.2)})
    records = [
        record.model_copy(update={"event": shifted}) if record.event == session.fit else record
        for record in session.all_records
    ]
    rows = {row[2]: row[3:] for row in fit_limit_rows(replace(session, all_records=tuple(records)), None)}
    assert rows["drift_px"] == (1.2, "at most 1", "fail")


def test_a_value_that_is_not_known_has_no_verdict() -> None:
    assert fit_limit_rows(record(), None)[1][3:] == (None, "at most 0.2", "")


def test_a_laser_without_residuals_has_no_standoff(monkeypatch: pytest.MonkeyPatch) -> None:
    session = record()
    assert session.fit is not None
    lost = session.rig.laser_ids[0]
    others = tuple(one for one in session.fit.residuals if one.laser_id != lost)
    monkeypatch.setitem(vars(session), "fit", session.fit.model_copy(update={"residuals": others}))
    rows = {row[2]: row[3:] for row in fit_limit_rows(session, session.calibration)}
    assert rows["standoffs"] == (0, "at least 3", "fail")


@pytest.mark.parametrize("wrong", ["steps: [", "max_rms_px: x", "unknown: 1"])
def test_a_procedure_of_another_version_gives_no_rows(wrong: str) -> None:
    assert fit_limit_rows(with_procedure("max_rms_px: 0.5", wrong), None) == []
