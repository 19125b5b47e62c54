"""`workbench fit`."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from workbench.calibration.assess import Assessment, derive
from workbench.calibration.export import calibrate, write_calibration
from workbench.calibration.fit import Fit
from workbench.calibration.fit import fit as fit_sightings
from workbench.calibration.records import parameter_records
from workbench.calibration.sightings import sight_rows
from workbench.cli.call import command_line, now, operator
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Provenance
from workbench.model.captures import parse_captures, read_captures_file
from workbench.model.errors import LimitFailedError
from workbench.model.rig import Rig, load_rig
from workbench.report.tables import derived_table, parameter_table, rejected_lines
from workbench.session.manifest import workbench_version


def fit_captures(captures: Path, rig_path: Path, output: Path, as_json: bool) -> None:
    """Fit, print, and write the calibration if it is accepted.

    Raises:
        BadInputError: a file is wrong.
        LimitFailedError: the calibration is refused; nothing is written.
    """
    rig = load_rig(rig_path)
    content = read_captures_file(captures)
    fitted = fit_sightings(rig, *sight_rows(rig, parse_captures(captures, content)))
    calibration, assessment = calibrate(fitted, Acceptance(), _provenance(rig, content))
    if as_json:
        print(json.dumps(_as_json(fitted, assessment)))
    _print_tables(fitted, assessment)
    if assessment.verdict == "refused":
        raise LimitFailedError(
            f"the calibration is refused and {output} is not written: " + "; ".join(assessment.reasons)
        )
    write_calibration(output, calibration)


def _provenance(rig: Rig, captures: bytes) -> Provenance:
    return Provenance(
        session="",
        captures_sha256=hashlib.sha256(captures).hexdigest(),
        rig=rig.rig,
        serial=rig.serial,
        command=command_line(),
        version=workbench_version(),
        operator=operator(),
        created=now(),
    )


def _as_json(fitted: Fit, assessment: Assessment) -> dict[str, Any]:
    parameters = [
        {key: getattr(p, key) for key in ("name", "unit", "value", "sd", "prior_sd", "data_share")}
        | {"determined_by": p.determined_by}
        for p in parameter_records(fitted)
    ]
    derived = [{"laser": d.pop("laser_id"), **d} for d in (asdict(derived) for derived in derive(fitted))]
    return {
        "parameters": parameters,
        "derived": derived,
        "rms_px": fitted.rms_px,
        "observations": len(fitted.used),
        "rejected": [
            {"row": int(r.source.removeprefix("row ")), "reason": r.reason} for r in fitted.rejected
        ],
        "warnings": list(assessment.warnings),
        "verdict": assessment.verdict,
        "reasons": list(assessment.reasons),
    }


def _print_tables(fitted: Fit, assessment: Assessment) -> None:
    console = Console(stderr=True)
    console.print(parameter_table(parameter_records(fitted)))
    console.print(derived_table(derive(fitted)))
    console.print(f"residual rms {fitted.rms_px:.2f} px over {len(fitted.used)} observations")
    for line in rejected_lines(fitted.rejected):
        console.print(f"not used: {line}", highlight=False)
    for warning in assessment.warnings:
        console.print(f"note: {warning}", highlight=False)
    console.print(f"verdict: {assessment.verdict}")
