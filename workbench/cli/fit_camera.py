"""`workbench fit` of a camera alone: a rig file without lasers, and views of its board."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.camera import render_camera
from workbench.calibration.verdict.records import parameter_records
from workbench.cli.brief_notes import brief_notes, merge_equal_kinds
from workbench.cli.console import result_console
from workbench.cli.verdict import Verdict, VerdictShownError, and_more, show_verdict, split_reason
from workbench.model.camera_file import CameraCalibration
from workbench.model.fit_tables import parameter_table
from workbench.model.number_text import counted
from workbench.model.table import Column, Table
from workbench.report.rejected_lines import rejected_lines
from workbench.report.terminal_table import TerminalTable
from workbench.session.files import write_output


def show_camera(
    fitted: CalibrationFit,
    calibration: CameraCalibration,
    output: Path,
    accept: str | None,
    as_json: bool,
    details: bool,
) -> None:
    """Print the calibration of a camera, and write it if it is accepted.

    Args:
        fitted: the fit.
        calibration: its file.
        output: path of the file.
        accept: reason for writing a refused calibration; None: it is not written.
        as_json: whether to print the result as JSON too.
        details: whether to print the tables below the verdict, and all notes.

    Raises:
        LimitFailedError: the calibration is refused; nothing is written.
    """
    summary = calibration.workbench_camera.fit
    refused = summary.verdict == "refused" and accept is None
    if not refused:
        write_output(output, render_camera(_accepted(calibration, accept)).encode())
    if as_json:
        print(json.dumps(_as_json(fitted, calibration)))
    show_verdict(_verdict(fitted, calibration, output, accept, details))
    if details:
        _print_tables(fitted, calibration, as_json)
    if refused:
        raise VerdictShownError(f"the calibration is refused; {output} is not written")


def _accepted(calibration: CameraCalibration, because: str | None) -> CameraCalibration:
    block = calibration.workbench_camera
    if block.fit.verdict == "accepted" or because is None:
        return calibration
    summary = block.fit.model_copy(update={"accepted_because": because})
    return calibration.model_copy(update={"workbench_camera": block.model_copy(update={"fit": summary})})


def _verdict(
    fitted: CalibrationFit, calibration: CameraCalibration, output: Path, accept: str | None, details: bool
) -> Verdict:
    summary = calibration.workbench_camera.fit
    not_used = [f"not used: {line}" for line in merge_equal_kinds(r.reason for r in fitted.rejected)]
    notes = [] if details else [*brief_notes(summary.warnings), *not_used]
    if summary.verdict == "refused" and accept is None:
        return Verdict(
            word="REFUSED",
            headline=and_more(summary.reasons),
            action=split_reason(summary.reasons[0])[1],
            notes=notes,
            labelled=[("file:", f"{output} is not written")],
        )
    because = [f"accepted because: {accept}"] if summary.reasons else []
    lens = calibration.workbench_camera.parameters
    headline = (
        f"f {lens.values[0]:.2f} +- {lens.sd[0]:.2f} px (1 sigma); rms {summary.rms_px:.2f} px over"
        f" {counted(sum(view.corners for view in summary.views), 'corner')} in"
        f" {counted(len(summary.views), 'view')}"
    )
    return Verdict(
        word="ACCEPTED",
        headline=headline,
        facts=[*because, *(f"although {split_reason(reason)[0]}" for reason in summary.reasons)],
        notes=notes,
        labelled=[("file:", f"{output} written")],
    )


def _as_json(fitted: CalibrationFit, calibration: CameraCalibration) -> dict[str, Any]:
    parameters = [
        {key: getattr(p, key) for key in ("name", "unit", "value", "sd", "prior_sd", "data_share")}
        | {"determined_by": p.determined_by}
        for p in parameter_records(fitted)[fitted.layout.lens]
    ]
    summary = calibration.workbench_camera.fit
    return {
        "parameters": parameters,
        "views": [view.model_dump() for view in summary.views],
        "rms_px": summary.rms_px,
        "noise_scale": summary.noise_scale,
        "rejected": [{"source": r.source, "reason": r.reason} for r in fitted.rejected],
        "warnings": list(summary.warnings),
        "verdict": summary.verdict,
        "reasons": list(summary.reasons),
        "terms": [term.model_dump() for term in fitted.terms],
    }


def _print_tables(fitted: CalibrationFit, calibration: CameraCalibration, as_json: bool) -> None:
    console = result_console(as_json)
    summary = calibration.workbench_camera.fit
    console.print(TerminalTable(parameter_table(parameter_records(fitted)[fitted.layout.lens])))
    console.print(TerminalTable(_view_table(calibration)))
    for reason in summary.reasons:
        console.print(f"reason: {reason}", highlight=False)
    for line in rejected_lines(fitted.rejected):
        console.print(f"rejected: {line}", highlight=False)
    for warning in summary.warnings:
        console.print(f"note: {warning}", highlight=False)


def _view_table(calibration: CameraCalibration) -> Table:
    return Table(
        name="views",
        title="Views of the board",
        columns=(
            Column(key="view", name="view"),
            Column(key="corners", name="corners"),
            Column(key="rms_px", name="residual rms", unit="px", format=".3f"),
            Column(key="remark", name="remark"),
        ),
        rows=tuple(
            (view.name, view.corners, view.rms_px, "suspect" if view.suspect else "")
            for view in calibration.workbench_camera.fit.views
        ),
    )
