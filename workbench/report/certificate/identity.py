"""Sections on who and what: laboratory, sensor, conditions, reference standards."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model import event as ev
from workbench.model.laboratory import Laboratory, Party, Span
from workbench.model.number_text import duration
from workbench.model.rig import UNKNOWN_SERIAL, BenchSpec, Rig
from workbench.model.table import Column, Table
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import NOT_STATED, Fact, Section

VIRTUAL = "virtual bench: no real sensor was measured"
OVERRULED = "overruled"
"""Answer that keeps results in spite of a failed check."""
MOST_NAMED = 12
"""Largest number of lasers that are named one by one."""


def laboratory_section(lab: Laboratory, session: SessionRecord) -> Section:
    """Laboratory, customer, place, dates, persons."""
    began, ended = session.began, session.ended
    days = f"{began:%Y-%m-%d %H:%M} to {ended:%Y-%m-%d %H:%M} UTC" if began and ended else NOT_STATED
    facts = (
        Fact("Laboratory", party_text(lab.laboratory)),
        Fact(
            "Place of the work", lab.place or (lab.laboratory.address if lab.laboratory else "") or NOT_STATED
        ),
        Fact("Customer", party_text(lab.customer)),
        Fact("Sensor received", str(lab.received or NOT_STATED)),
        Fact("Measured", days),
        Fact("Operator", ", ".join(operators(session))),
        Fact("Authorised by", lab.authorised_by or NOT_STATED),
        *((Fact("Remarks", lab.remarks),) if lab.remarks else ()),
    )
    return Section("laboratory", "Laboratory and customer", facts)


def sensor_section(rig: Rig) -> Section:
    """The calibrated item."""
    camera = rig.camera
    ids = rig.laser_ids
    named = ", ".join(ids) if len(ids) <= MOST_NAMED else f"{ids[0]} to {ids[-1]}"
    facts = (
        Fact("Rig", rig.rig),
        Fact("Serial number", rig.serial if rig.serial != UNKNOWN_SERIAL else NOT_STATED),
        Fact("Lasers", f"{len(ids)}: {named}"),
        Fact("Laser class", rig.laser_class or NOT_STATED),
        Fact(
            "Camera",
            f"{camera.width_px} x {camera.height_px} px, {camera.bits} bits, lens model {camera.lens}",
        ),
        Fact("Devices", device_text(rig)),
        Fact("Reference plane", "ranges are measured from the rig's reference plane, perpendicular to it"),
    )
    return Section("sensor", "Calibrated sensor", facts)


def conditions_section(lab: Laboratory, session: SessionRecord) -> Section:
    """Ambient conditions, warm-up and target, as stated and as answered in the session."""
    bench, ambient = session.rig.bench, lab.ambient
    outcomes = {f"{one.procedure}.{one.index}": one.outcome for one in session.events(ev.StepFinished)}
    tilt = (
        f"square to the optical axis within {bench.target_tilt_sd_deg:g} deg (1 sigma, all placements), with"
        f" {bench.tilt_sd_deg:g} deg at each placement; {_measured_tilt(bench)}"
    )
    facts = (
        Fact("Temperature, lowest and highest", span_text(ambient.temperature_c, "deg C")),
        Fact("Relative humidity", span_text(ambient.humidity_percent, "%")),
        Fact("Warm-up before the session", _minutes(lab.warm_up_min)),
        Fact("Warm-up in the session", _warm_up(session)),
        Fact("Target material", lab.target_material or NOT_STATED),
        Fact("Target tilt", tilt),
    )
    table = Table(
        name="answers",
        title="Questions of the session and their answers",
        columns=(
            Column(key="question", name="question"),
            Column(key="answer", name="answer"),
            Column(key="by", name="answered by"),
        ),
        rows=tuple(
            (one.question, _answer_text(one, outcomes.get(one.key)), one.answer.by)
            for one in session.events(ev.Answered)
            if one.key != "safety"
        ),
    )
    return Section("conditions", "Conditions", facts, tables=(table,) if table.rows else ())


def _measured_tilt(bench: BenchSpec) -> str:
    """Tilt of the rail, as far as the rig file states it."""
    names = {"yaw": "target_yaw_deg", "pitch": "target_pitch_deg"}
    texts = [
        f"{what} {getattr(bench, name):g} deg"
        for what, name in names.items()
        if name in bench.model_fields_set
    ]
    return f"measured {', '.join(texts)}" if texts else "yaw and pitch of the rail were not measured"


def standards_section(lab: Laboratory, rig: Rig) -> Section:
    """Instruments and reference standards, and the reference uncertainty that the fit used."""
    bench = rig.bench
    facts = (
        Fact("Standoff of a placement", f"standard uncertainty {bench.placement_sd_mm:g} mm (rig file)"),
        Fact(
            "Scale of the ruler",
            f"standard uncertainty {100 * bench.ruler_scale.sd:g} % of the range (rig file)",
        ),
    )
    table = Table(
        name="standards",
        title="Instruments and reference standards",
        columns=(
            Column(key="name", name="standard"),
            Column(key="serial", name="serial number"),
            Column(key="certificate", name="certificate"),
            Column(key="calibrated", name="calibrated"),
            Column(key="due", name="due"),
            Column(key="expanded_uncertainty", name="U", format="g"),
            Column(key="unit", name="unit of U"),
            Column(key="coverage_factor", name="k", format="g"),
        ),
        rows=tuple(
            (
                one.name,
                one.serial,
                one.certificate or NOT_STATED,
                str(one.calibrated or NOT_STATED),
                str(one.due or NOT_STATED),
                one.expanded_uncertainty,
                one.unit,
                one.coverage_factor if one.expanded_uncertainty is not None else None,
            )
            for one in lab.standards
        ),
    )
    text = (
        "Ranges are traceable to the standards above as far as their certificates are stated."
        if table.rows
        else "No reference standard is stated in lab.yaml. The reference uncertainty is that of the rig file;"
        " metrological traceability is not shown."
    )
    return Section(
        "standards", "Reference standards and traceability", facts, (text,), (table,) if table.rows else ()
    )


def operators(session: SessionRecord) -> Sequence[str]:
    """Names of the accounts that ran or continued the session, each once."""
    continued = [event.operator for _, event in session.timed(ev.SessionResumed)]
    continued += [event.operator for _, event in session.timed(ev.SessionRepaired)]
    return list(dict.fromkeys([session.manifest.operator, *continued]))


def party_text(party: Party | None) -> str:
    """Name, address and contact in one line."""
    if party is None:
        return NOT_STATED
    return ", ".join(filter(None, (party.name, party.address, party.contact)))


def span_text(span: Span | None, unit: str) -> str:
    """Lowest and highest value with their unit."""
    return NOT_STATED if span is None else f"{span[0]:g} to {span[1]:g} {unit}"


def device_text(rig: Rig) -> str:
    """Drivers of the devices."""
    if rig.driver not in {None, "opencv+serial"}:
        return VIRTUAL if rig.driver == "emulated" else f"bench driver {rig.driver}"
    if rig.devices is None:
        return NOT_STATED
    blocks = {"camera": rig.devices.camera, "lasers": rig.devices.lasers, "target": rig.devices.target}
    return ", ".join(f"{name} {block.driver or 'default'}" for name, block in blocks.items())


def _minutes(minutes: float | None) -> str:
    return NOT_STATED if minutes is None else f"{minutes:g} min"


def _warm_up(session: SessionRecord) -> str:
    """Outcomes and durations of the warm-up steps of the session."""
    began: int | None = None
    found = []
    for record in session.records:
        if isinstance(record.event, ev.StepStarted):
            began = record.time_ns if record.event.step == "warm_up" else None
        elif isinstance(record.event, ev.StepFinished) and began is not None:
            found.append(f"{record.event.outcome} in {duration((record.time_ns - began) / 1e9)}")
            began = None
    return ", ".join(found) or "no warm-up step"


def _answer_text(one: ev.Answered, outcome: str | None) -> str:
    """Outcome of the step that asked, unless the question was about a failed check; else the answer."""
    if outcome and not one.overrules:
        return outcome
    value = one.answer.value
    done = OVERRULED if one.overrules else one.answer.action
    text = f"{value:g}" if isinstance(value, float) else value or done
    return f"{text} ({one.answer.reason})" if one.answer.reason else text
