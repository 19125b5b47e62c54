"""`workbench fit`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence, Set
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict.assessment import Assessment, derive
from workbench.calibration.verdict.export import accept_with_reason, calibrate, write_calibration
from workbench.calibration.verdict.records import fit_finished, parameter_records
from workbench.calibration.verdict.tables import derived_table
from workbench.cli.brief_notes import brief_notes, merge_equal_kinds
from workbench.cli.captures_source import calibration_table
from workbench.cli.console import result_console
from workbench.cli.invocation import command_line
from workbench.cli.verdict import Verdict, VerdictShownError, and_more, show_verdict, split_reason
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration, Provenance
from workbench.model.captures import (
    CaptureRow,
    check_images,
    errors_name_file,
    parse_captures,
    read_captures_file,
)
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.fit_tables import cross_validation_table, parameter_table, term_table
from workbench.model.nested import fix_parameters
from workbench.model.number_text import counted
from workbench.model.rig import Rig, load_rig
from workbench.report.rejected_lines import rejected_lines
from workbench.report.terminal_table import TerminalTable
from workbench.session.caller import now, operator
from workbench.session.compression import compression_notes
from workbench.session.files import check_output
from workbench.session.manifest import MANIFEST, load_session_rig, workbench_version

MOST_ROWS = 12
"""Largest number of rejected rows that an error prints."""


@dataclass(frozen=True)
class Request:
    """Arguments of the command."""

    source: Path
    """Captures file or session folder."""
    rig: Path | None
    """Rig file; None: that of the session."""
    output: Path
    accept: str | None
    """Reason for accepting a calibration that fails its limits."""
    without_mm: tuple[float, ...]
    """Standoffs to exclude."""
    fixed: tuple[str, ...] = ()
    """Names of parameters to fix at the rig file's value."""
    recording: Path | None = None
    """Recording of the fit for the viewer; None: none."""


@dataclass(frozen=True)
class FittedSource:
    """Fit of a captures file, or of a session."""

    rows: Sequence[CaptureRow]
    """Rows that were not excluded."""
    fitted: CalibrationFit
    calibration: Calibration
    assessment: Assessment


def fit_source(request: Request) -> FittedSource:
    """Fit the captures of a request, without writing anything.

    Raises:
        BadInputError: a file or an option is wrong.
        LimitFailedError: the fit has no finite result.
    """
    rig = fix_parameters(_rig(request), request.fixed)
    if request.source.suffix == ".rrd":
        return _fit_recording(rig, request)
    captures, content, rows = _captures(request)
    fitted = fit_calibration(rig, *_observations(rig, rows, captures, request))
    digest = hashlib.sha256(content).hexdigest()
    provenance = _provenance(rig, request, digest)
    calibration, assessment = calibrate(fitted, Acceptance(), provenance, compression_notes(rows))
    kept = [row for row in rows if row.standoff_mm not in request.without_mm]
    return FittedSource(kept, fitted, calibration, assessment)


def _fit_recording(rig: Rig, request: Request) -> FittedSource:
    from workbench.viewer.readback import observations_of_recording

    found, rejected, boards = observations_of_recording(request.source, rig)
    known = {observation.standoff_mm for observation in found}
    _check_known(request.without_mm, known)
    kept = [one for one in found if one.standoff_mm not in request.without_mm]
    views = [view for view in boards if view.placement.standoff_mm not in request.without_mm]
    fitted = fit_calibration(rig, kept, rejected, views)
    calibration, assessment = calibrate(
        fitted, Acceptance(), _provenance(rig, request, file_sha256(request.source))
    )
    return FittedSource((), fitted, calibration, assessment)


def fit_captures(request: Request, as_json: bool, details: bool = False) -> None:
    """Fit and print a calibration, and write it if it is accepted.

    Args:
        request: arguments of the command.
        as_json: whether to print the result as JSON too.
        details: whether to print the tables below the verdict, and all notes.

    Raises:
        BadInputError: a file or an option is wrong.
        LimitFailedError: the calibration is refused; nothing is written.
    """
    check_output(request.output)
    if request.recording is not None:
        check_output(request.recording)
    _check_distinct(request)
    rig = fix_parameters(_rig(request), request.fixed)
    if not rig.lasers:
        _fit_camera(rig, request, as_json, details)
        return
    found = fit_source(request)
    fitted, calibration, assessment = found.fitted, found.calibration, found.assessment
    refused = assessment.verdict == "refused" and request.accept is None
    if assessment.verdict == "refused" and request.accept is not None:
        calibration = accept_with_reason(calibration, request.accept)
    if not refused:  # before printing, which fails if the reader of the output has ended
        write_calibration(request.output, calibration)
    if request.recording is not None:  # of a refused fit, too: to see why
        record_fit(found, request.source.stem, request.recording)
    if as_json:
        print(json.dumps(_as_json(fitted, assessment)))
    show_verdict(_verdict(found, request, details))
    if details:
        _print_tables(fitted, assessment, as_json)
    if refused:
        raise VerdictShownError(f"the calibration is refused; {request.output} is not written")


def _fit_camera(rig: Rig, request: Request, as_json: bool, details: bool) -> None:
    """Fit and print the calibration of a camera alone, and write it if it is accepted."""
    from workbench.calibration.selection.camera_fit import fit_camera
    from workbench.calibration.verdict.camera import calibrate_camera
    from workbench.cli.fit_camera import show_camera

    captures, content, rows = _captures(request)
    if request.recording is not None or request.without_mm:
        raise BadInputError(
            f"{request.rig}: --recording and --without-standoff expect a rig with lasers, got one without"
        )
    with errors_name_file(captures):
        _, rejected, boards = observations_of_rows(rig, rows)
    fitted = fit_camera(rig, boards, rejected)
    provenance = _provenance(rig, request, hashlib.sha256(content).hexdigest())
    show_camera(
        fitted, calibrate_camera(fitted, provenance), request.output, request.accept, as_json, details
    )


def _captures(request: Request) -> tuple[Path, bytes, tuple[CaptureRow, ...]]:
    """Captures file of a request, its content, and its rows, whose images exist; of a session as recorded."""
    captures = calibration_table(request.source)
    content = read_captures_file(captures)
    rows = parse_captures(captures, content)
    if (request.source / MANIFEST).is_file():
        # Imported here: a fit of a captures file needs no events.
        from workbench.session.capture_table_check import check_captures

        check_captures(captures, content)
    check_images(captures, rows)
    return captures, content, rows


def record_fit(found: FittedSource, name: str, out: Path) -> None:
    """Write the recording of a fit: its captures with their frames, residuals, tables and verdict."""
    from workbench.viewer.fit_records import fit_records
    from workbench.viewer.recording import rebuild

    finished = fit_finished(found.fitted, found.assessment)
    rebuild(Path(), found.fitted.rig, fit_records(name, found.rows, found.fitted, finished), out)


def _check_distinct(request: Request) -> None:
    """Refuse an output that would overwrite the input of the calibration."""
    target = request.output.resolve()
    if target in {path.resolve() for path in (request.source, request.rig) if path is not None}:
        raise BadInputError(
            f"--output {request.output}: expected another file than the input of the calibration;"
            " name a new one"
        )
    session = next((folder for folder in target.parents if (folder / MANIFEST).is_file()), None)
    if session is not None and target.is_file():
        raise BadInputError(
            f"--output {request.output}: expected a new file, got one of the session {session}; name another"
        )


def _rig(request: Request) -> Rig:
    if request.rig is not None:
        return load_rig(request.rig, camera_alone=True)
    source = request.source
    if not source.exists():
        raise BadInputError(f"{source}: no such file or folder; expected a captures file or a session folder")
    if source.suffix == ".rrd" and (source.parent / MANIFEST).is_file():
        return load_session_rig(source.parent, bounded=True)
    if not source.is_dir():
        read_captures_file(source)  # a file of another kind is named as such
        raise BadInputError(f"{source}: a captures file needs --rig; only a session contains its rig file")
    return load_session_rig(source, bounded=True)


def _observations(
    rig: Rig, rows: Sequence[CaptureRow], captures: Path, request: Request
) -> tuple[list[Observation], list[Rejected], list[BoardView]]:
    known = {row.standoff_mm for row in rows}
    _check_known(request.without_mm, known)
    kept = [row for row in rows if row.standoff_mm not in request.without_mm]
    with errors_name_file(captures):
        observations, rejected, boards = observations_of_rows(rig, kept)
    excluded = [row for row in rows if row.standoff_mm in request.without_mm]
    rejected += [Rejected(f"row {row.row}", f"excluded: standoff {row.standoff_mm:g} mm") for row in excluded]
    if not observations:
        lines = [f"rejected: {line}" for line in rejected_lines(rejected)]
        more = [f"and {len(lines) - MOST_ROWS} more"] if len(lines) > MOST_ROWS else []
        first = f"{request.source}: no spot to fit; check that the rig file belongs to the captures"
        raise BadInputError("\n".join([first, *lines[:MOST_ROWS], *more]))
    return observations, rejected, boards


def _check_known(without_mm: Sequence[float], known: Set[float]) -> None:
    """Refuse a standoff to exclude that no capture has.

    Raises:
        BadInputError: there is one.
    """
    if unknown := [f"{s:g}" for s in without_mm if s not in known]:
        expected = ", ".join(f"{s:.12g}" for s in sorted(known))
        raise BadInputError(f"--without-standoff: expected one of {expected} mm, got {', '.join(unknown)} mm")


def _provenance(rig: Rig, request: Request, sha256: str) -> Provenance:
    return Provenance(
        session=request.source.resolve().name if request.source.is_dir() else "",
        captures_sha256=sha256,
        rig=rig.rig,
        serial=rig.serial,
        command=command_line(),
        version=workbench_version(),
        operator=operator(),
        created=now(),
    )


def _as_json(fitted: CalibrationFit, assessment: Assessment) -> dict[str, Any]:
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
        "rejected": [_rejected_json(r) for r in fitted.rejected],
        "warnings": list(assessment.warnings),
        "null_directions": [asdict(direction) for direction in assessment.directions],
        "verdict": assessment.verdict,
        "reasons": list(assessment.reasons),
        "faults": [fault.model_dump() for fault in assessment.faults],
        "left_out": [placement.model_dump() for placement in assessment.cross_validation],
        "residual_tests": [test.model_dump() for test in assessment.residual_tests],
        "terms": [term.model_dump() for term in fitted.terms],
    }


def _rejected_json(rejected: Rejected) -> dict[str, Any]:
    """Row of a captures file, or frame of a recording, with the reason of its rejection."""
    row = rejected.source.removeprefix("row ")
    return (
        {"row": int(row), "reason": rejected.reason}
        if row.isdigit()
        else {
            "source": rejected.source,
            "reason": rejected.reason,
        }
    )


def _verdict(found: FittedSource, request: Request, details: bool) -> Verdict:
    """Verdict on the fit, and the fate of the output."""
    assessment, fitted = found.assessment, found.fitted
    worst = found.calibration.laser_ranger.validity.max_relative_range_sd
    result = (
        f"rms {fitted.rms_px:.2f} px over {counted(len(fitted.used), 'observation')};"
        f" range uncertainty at most {100 * worst:.2g} % (1 sigma)"
    )
    not_used = [
        f"not used: {line}" for line in merge_equal_kinds(dict.fromkeys(r.reason for r in fitted.rejected))
    ]
    notes = [] if details else [*brief_notes(assessment.warnings), *not_used]
    if assessment.verdict == "refused" and request.accept is None:
        return Verdict(
            word="REFUSED",
            headline=and_more(assessment.reasons),
            action=split_reason(assessment.reasons[0])[1] + _leave_out_option(found),
            notes=notes,
            labelled=[("file:", f"{request.output} is not written")],
        )
    although = [f"although {split_reason(reason)[0]}" for reason in assessment.reasons]
    because = [f"accepted because: {request.accept}"] if although else []
    written = ("file:", f"{request.output} written")
    return Verdict(
        word="ACCEPTED", headline=result, facts=[*because, *although], notes=notes, labelled=[written]
    )


def _leave_out_option(found: FittedSource) -> str:
    """Options that leave out the suspected placements, in brackets; empty without suspects."""
    finished = fit_finished(found.fitted, found.assessment)
    at_mm = [p.standoff_mm for p in found.fitted.cells.placements if p.key in finished.suspects]
    options = " ".join(f"--without-standoff {standoff_mm:g}" for standoff_mm in dict.fromkeys(at_mm))
    return f" ({options})" if options else ""


def _print_tables(fitted: CalibrationFit, assessment: Assessment, as_json: bool) -> None:
    console = result_console(as_json)
    console.print(TerminalTable(parameter_table(parameter_records(fitted))))
    console.print(TerminalTable(derived_table(derive(fitted))))
    if fitted.terms:
        console.print(TerminalTable(term_table(fitted.terms)))
    console.print(f"residual rms {fitted.rms_px:.2f} px over {counted(len(fitted.used), 'observation')}")
    if fitted.boards:
        count, views = len(fitted.corner_residual_px), len(fitted.boards)
        console.print(
            f"board: {fitted.corner_rms_px:.3f} px over {counted(count, 'corner')} in"
            f" {counted(views, 'view')}"
        )
    if assessment.cross_validation:
        console.print(TerminalTable(cross_validation_table(assessment.cross_validation)))
    for reason in assessment.reasons:
        console.print(f"reason: {reason}", highlight=False)
    for line in rejected_lines(fitted.rejected):
        console.print(f"rejected: {line}", highlight=False)
    for warning in assessment.warnings:
        console.print(f"note: {warning}", highlight=False)
