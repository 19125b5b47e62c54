"""The recording holds what the records say, no more and no less."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tests.viewer.conftest import Recorded
from tests.viewer.readback import TIMELINES, Contents, LaidOut, front_tab, layout_views
from tests.viewer.session import (
    BAD,
    LASERS,
    READINGS,
    REPEATS,
    SESSION,
    STANDOFFS,
    TRIAL,
    TRIAL_STANDOFFS,
    a_fit,
)
from workbench.figures.picture import note, picture
from workbench.model import event as ev
from workbench.model.chart import laser_colors
from workbench.model.errors import BadInputError
from workbench.model.fit_charts import residual_chart
from workbench.model.prompt import Prompt
from workbench.viewer.open_recording import OpenRecording
from workbench.viewer.recording import RecordingConsumer, rebuild
from workbench.viewer.scene import BEYOND, DRAWN_DEPTH_MM
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import table_text

DATA = Path(__file__).parents[3] / "data"
IMAGE, FRAME = "/frame/image", "EncodedDepthImage:blob"
CAPTURES = len(LASERS) * len(STANDOFFS) * REPEATS + len(TRIAL_STANDOFFS) * READINGS


@pytest.fixture(scope="module")
def contents(recorded: Recorded) -> Contents:
    return Contents(recorded.recording)


@pytest.fixture(scope="module")
def taken(recorded: Recorded) -> list[ev.CaptureTaken]:
    return [record.event for record in recorded.records if isinstance(record.event, ev.CaptureTaken)]


def test_names_the_session_and_brings_its_layout(recorded: Recorded) -> None:
    reader = RrdReader(str(recorded.recording))
    (recording,) = reader.recordings()
    assert (recording.application_id, recording.recording_id) == ("workbench", SESSION)
    assert {layout.application_id for layout in reader.blueprints()} == {"workbench"}


def test_holds_every_frame_with_lasers_on_byte_for_byte(
    recorded: Recorded, contents: Contents, taken: list[ev.CaptureTaken]
) -> None:
    frames = contents.values(IMAGE, FRAME)
    assert [number for number, _ in frames] == list(range(1, CAPTURES + 1))
    assert [png for _, png in frames] == [(recorded.folder / one.on.path).read_bytes() for one in taken]


def test_frames_and_spots_are_at_the_exposure(contents: Contents, taken: list[ev.CaptureTaken]) -> None:
    exposures = [np.datetime64(one.on.time_ns, "ns") for one in taken]
    for entity, component in (
        (IMAGE, "EncodedDepthImage:media_type"),
        ("/frame/spots", "Points2D:positions"),
        ("/spots/record", "u_px"),
    ):
        times = dict(contents.values(entity, component, "time"))
        assert [np.datetime64(time) for time in times] == exposures


@pytest.mark.parametrize("quantity", ["u_px", "v_px", "u_sd_px", "v_sd_px", "flux_dn", "width_px", "peak_dn"])
def test_spots_are_logged_to_the_last_bit(recorded: Recorded, contents: Contents, quantity: str) -> None:
    found = [r.event for r in recorded.records if isinstance(r.event, ev.SpotsFound)]
    expected = [
        (number, [getattr(spot, quantity) for spot in event.spots])
        for number, event in enumerate(found, start=1)
    ]
    assert contents.values("/spots/record", quantity) == expected


@pytest.mark.parametrize("laser", LASERS)
def test_curves_have_the_spots_of_captures_and_of_readings(
    recorded: Recorded, contents: Contents, laser: str
) -> None:
    """Spots of a capture of all lasers get their lasers by the reading."""
    numbered = enumerate((r.event for r in recorded.records if isinstance(r.event, ev.SpotsFound)), start=1)
    expected = []
    for number, event in numbered:
        mine = event.spots[list(LASERS).index(laser)] if len(event.spots) > 1 else event.spots[0]
        if len(event.spots) > 1 or mine.laser_id == laser:
            expected.append((number, [mine.peak_dn]))
    assert contents.values(f"/spots/peak_dn/{laser}", "Scalars:scalars") == expected


def test_spots_have_their_lasers_as_labels(contents: Contents) -> None:
    labels = contents.values("/frame/spots", "Points2D:labels")
    assert labels[0][1] == ["L1"]
    assert [texts for number, texts in labels if number == CAPTURES] == [["?"] * 4, list(LASERS)]


SPATIAL = (FRAME, "EncodedImage:blob", "Pinhole:image_from_camera")


def has_content(contents: Contents, view: LaidOut, timeline: str, at: object) -> bool:
    """Whether a view shows something with the cursor at a place of a timeline.

    Documents, pictures and the bench show what is latest; curves, lanes and the log show all times.
    """
    entities = contents.below(view.origin)
    if view.kind in {"TimeSeries", "StateTimeline", "TextLog"}:
        component = {
            "TimeSeries": ("Scalars:scalars", "Measurements:values"),
            "StateTimeline": ("StateChange:state",),
            "TextLog": ("TextLog:text",),
        }[view.kind]
        return any(contents.values(entity, one, timeline) for entity in entities for one in component)
    components = ("TextDocument:text",) if view.kind == "TextDocument" else SPATIAL
    return any(contents.shown(entity, one, timeline, at) for entity in entities for one in components)


@pytest.mark.parametrize("timeline", TIMELINES)
def test_every_view_has_content_on_every_timeline(
    recorded: Recorded, contents: Contents, timeline: str
) -> None:
    """At every place of a counting timeline, and at every exposure by the wall clock."""
    positions = contents.positions(timeline)
    if timeline == "time":
        positions = [at for at, _ in contents.values(IMAGE, FRAME, "time")] + positions[-1:]
    assert len(positions) >= len(STANDOFFS) + len(TRIAL_STANDOFFS)
    for view in layout_views(recorded.recording):
        for at in positions:
            assert has_content(contents, view, timeline, at), (view.name, at)


def recording_of(recorded: Recorded, records: Iterable[ev.Record], out: Path) -> Path:
    with RecordingConsumer(recorded.folder, recorded.rig, out) as consumer:
        for record in records:
            consumer(record)
    return out


def test_a_session_of_a_trial_alone_has_curves_of_its_spots(recorded: Recorded, tmp_path: Path) -> None:
    """Its lasers are known by the readings only."""
    first, *others = recorded.records
    (start,) = (n for n, record in enumerate(others) if _starts_trial(record.event))
    out = recording_of(recorded, [first, *others[start:]], tmp_path / "trial.rrd")
    contents = Contents(out)
    views = [view for view in layout_views(out) if view.origin.startswith(("/spots", "/trials", "/frame"))]
    assert len(views) >= 6
    for view in views:
        assert has_content(contents, view, "capture", 1), view.name


def test_a_session_with_an_existing_calibration_has_no_screens_of_a_fit(
    recorded: Recorded, tmp_path: Path
) -> None:
    first, *others = recorded.records
    (start,) = (n for n, record in enumerate(others) if _starts_trial(record.event))
    copy = Path("existing.yaml")
    (recorded.folder / copy).write_bytes((DATA / "session-0.1.0/calibration.yaml").read_bytes())
    loaded = ev.CalibrationLoaded(file="c", path=str(copy), sha256="", made="", age_days=None)
    record = ev.Record(n=1, time_ns=first.time_ns, event=loaded)
    out = recording_of(recorded, [first, record, *others[start:]], tmp_path / "trial.rrd")
    assert not any(view.origin.startswith(("/fit", "/progress")) for view in layout_views(out))
    assert Contents(out).values("/frame/predicted_ellipses", "LineStrips2D:strips")


def test_a_simulation_has_no_screens_of_captures(recorded: Recorded, tmp_path: Path) -> None:
    first, *others = recorded.records
    kinds = (ev.ProcedureStarted, ev.StepStarted, ev.TrialFinished, ev.SessionFinished)
    (start,) = (n for n, record in enumerate(others) if _starts_trial(record.event))
    kept = [record for record in others[start:] if isinstance(record.event, kinds)]
    out = recording_of(recorded, [first, *kept], tmp_path / "simulation.rrd")
    contents, views = Contents(out), layout_views(out)
    assert front_tab(out) == TRIAL
    assert {view.origin for view in views} >= {f"/trials/{TRIAL}/tables", "/steps/log"}
    for view in views:
        assert has_content(contents, view, "capture", 1), view.name


def test_the_open_prompt_is_shown_until_the_next_event(recorded: Recorded, tmp_path: Path) -> None:
    prompt = Prompt(key="k", do="Place the target at 200 mm.")
    placed = next(n for n, r in enumerate(recorded.records) if isinstance(r.event, ev.TargetPlaced))
    shown = []
    for name, after in (("asked", 0), ("answered", 1)):
        out = tmp_path / f"{name}.rrd"
        with RecordingConsumer(recorded.folder, recorded.rig, out) as consumer:
            for record in recorded.records[:placed]:
                consumer(record)
            consumer.show_prompt(prompt)
            for record in recorded.records[placed : placed + after]:
                consumer(record)
        # Of static values a recording keeps the last for certain, earlier ones by chance.
        ((text,),) = Contents(out).static("/task", "TextDocument:text")[-1:]
        shown.append(text)
    assert prompt.do in shown[0]
    assert shown[1] == "**Step 1 of 6: Capture at 200 mm**"


def test_a_finished_recording_shows_no_task(recorded: Recorded) -> None:
    assert "/task" not in {view.origin for view in layout_views(recorded.recording)}


def _starts_trial(event: object) -> bool:
    return isinstance(event, ev.ProcedureStarted) and event.procedure == TRIAL


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("last", "front"),
    [
        (ev.CaptureTaken, "Captures"),
        (ev.FitFinished, "Calibration: which standoff?"),
        (ev.ReadingTaken, TRIAL),
        (ev.TrialFinished, TRIAL),
    ],
)
def test_the_screen_in_front_follows_the_session(
    recorded: Recorded, tmp_path: Path, last: type, front: str
) -> None:
    end = next(n for n, record in enumerate(recorded.records) if isinstance(record.event, last))
    out = recording_of(recorded, recorded.records[: end + 1], tmp_path / "part.rrd")
    assert front_tab(out) == front


FIT_TEXTS = ("/fit/verdict", "/fit/worst", "/fit/checks", "/fit/parameter_table")


@pytest.mark.long_cases
@pytest.mark.parametrize("timeline", TIMELINES)
def test_nothing_of_a_fit_disappears_at_earlier_places(contents: Contents, timeline: str) -> None:
    for at in contents.positions(timeline):
        for entity in FIT_TEXTS:
            assert "No fit yet" not in contents.shown(entity, "TextDocument:text", timeline, at)[0]
        for axis in "uv":
            shown = contents.shown(f"/fit/picture/{axis}/image", "EncodedImage:blob", timeline, at)
            assert shown != note("no fit yet")


FIRST = {standoff: 1 + visit * len(LASERS) * REPEATS for visit, standoff in enumerate(STANDOFFS)} | {
    standoff: 1 + len(STANDOFFS) * len(LASERS) * REPEATS + visit * READINGS
    for visit, standoff in enumerate(TRIAL_STANDOFFS)
}
"""First capture at each standoff."""
LAST = {
    standoff: first + (len(LASERS) * REPEATS if standoff in STANDOFFS else READINGS) - 1
    for standoff, first in FIRST.items()
}


@pytest.mark.parametrize("standoff_mm", FIRST)
def test_at_a_standoff_everything_is_of_the_last_capture_there(
    recorded: Recorded, contents: Contents, taken: list[ev.CaptureTaken], standoff_mm: float
) -> None:
    """What comes between placements, as a fit, does not cover it."""
    here = round(standoff_mm)
    last = LAST[standoff_mm]
    png = (recorded.folder / taken[last - 1].on.path).read_bytes()
    assert contents.shown(IMAGE, FRAME, "standoff_mm", here) == png
    (now,) = contents.shown("/now", "TextDocument:text", "standoff_mm", here)
    assert f"{last}: {standoff_mm:g} mm" in now
    (label,) = contents.shown("/bench/target/label", "Points3D:labels", "standoff_mm", here)
    assert f"{standoff_mm:g} mm" in label
    laser = "L4" if standoff_mm in STANDOFFS else "unassigned"
    assert contents.shown(f"/bench/spots/{laser}", "Points3D:positions", "standoff_mm", here)
    texts = contents.shown("/crops/labels", "Points2D:labels", "standoff_mm", here)
    assert all("peak" in text for text in texts)
    assert contents.shown("/frame/scanlines", "LineStrips2D:strips", "standoff_mm", here)


@pytest.mark.parametrize("standoff_mm", STANDOFFS)
def test_the_frame_in_the_residuals_is_at_the_standoff_of_the_cursor(
    contents: Contents, standoff_mm: float
) -> None:
    colors = laser_colors(list(LASERS))
    column = picture(residual_chart(a_fit(), "u"), colors).x_px[standoff_mm]
    for timeline, at in (
        ("capture", FIRST[standoff_mm]),
        ("capture", LAST[standoff_mm]),
        ("standoff_mm", round(standoff_mm)),
    ):
        (strip,) = contents.shown("/fit/picture/u/cursor", "LineStrips2D:strips", timeline, at)
        assert np.mean([min(strip)[0], max(strip)[0]]) == pytest.approx(column, abs=1e-3)


def test_the_target_moves_with_the_capture_that_it_is_placed_for(contents: Contents) -> None:
    labels = contents.values("/bench/target/label", "Points3D:labels")
    placed = {number: text for number, (text,) in labels}
    for standoff, first in FIRST.items():
        assert f"{standoff:g} mm" in placed[first]


def test_the_worst_placement_is_listed_with_its_captures(contents: Contents) -> None:
    (text,) = contents.static("/fit/worst", "TextDocument:text")[-1]
    row = text.partition("─\n")[2].splitlines()[0].split()
    assert row[0] == f"{BAD[1]:g}"
    assert row[-1] == f"{FIRST[BAD[1]]}-{LAST[BAD[1]]}"


def test_readings_and_the_trial_table(recorded: Recorded, contents: Contents) -> None:
    readings = [r.event for r in recorded.records if isinstance(r.event, ev.ReadingTaken)]
    errors = contents.values(f"/trials/{TRIAL}/errors/sensor", "Measurements:values")
    assert [value for _, (value,) in errors] == [(one.range_mm or 0.0) - one.standoff_mm for one in readings]
    bands = contents.values(f"/trials/{TRIAL}/errors/L2", "Measurements:variances")
    assert [value for _, (value,) in bands] == [one.lasers[1].sigma_mm ** 2 for one in readings]
    (table,) = contents.static(f"/trials/{TRIAL}/tables", "TextDocument:text")[-1]
    (finished,) = [r.event for r in recorded.records if isinstance(r.event, ev.TrialFinished)]
    assert all(table_text(one) in table for one in finished.tables)
    for chart in finished.charts:
        entity = f"/trials/{TRIAL}/pictures/{chart.name}/image"
        assert len(contents.static(entity, "EncodedImage:blob")) == 1


def test_lanes_and_log_follow_the_steps(contents: Contents) -> None:
    steps = contents.values("/steps/lanes/step", "StateChange:state", "step")
    assert [number for number, _ in steps] == [*range(1, 10), 9]
    assert [state for _, (state,) in steps][:2] == ["Capture at 200 mm", "Capture at 500 mm"]
    lasers = contents.values("/steps/lanes/laser", "StateChange:state")
    on = [state for number, (state,) in lasers if number == FIRST[500.0]]
    assert on == ["L1"]
    log = [text for _, (text,) in contents.values("/steps/log", "TextLog:text", "time")]
    assert log[0].startswith(f"Session {SESSION} on made-up")
    assert log[-1] == "Session ended (0): done"


def test_an_equal_state_of_a_lane_is_logged_once_a_standoff(contents: Contents) -> None:
    for lane, states in (("laser", len(LASERS)), ("saturation", 1)):
        logged = contents.values(f"/steps/lanes/{lane}", "StateChange:state", "standoff_mm")
        assert [mm for mm, _ in logged if mm in STANDOFFS] == [mm for mm in STANDOFFS for _ in range(states)]


@pytest.mark.long_cases
@pytest.mark.parametrize(("least_s", "kind"), [(0.0, ev.SpotsFound), (float("inf"), ev.StepFinished)])
def test_the_file_is_checked_now_and_then_and_at_the_end_of_each_step(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, least_s: float, kind: type[ev.Event]
) -> None:
    monkeypatch.setattr("workbench.viewer.recording.CHECK_S", least_s)
    checked: list[ev.Event] = []
    with RecordingConsumer(recorded.folder, recorded.rig, tmp_path / "r.rrd") as consumer:
        for record in recorded.records:
            monkeypatch.setattr(Stream, "check_written", lambda _, event=record.event: checked.append(event))
            consumer(record)
    expected = [one.event for one in recorded.records if isinstance(one.event, kind | ev.StepFinished)]
    assert checked == expected


def test_rays_are_of_the_priors_before_the_fit_and_of_the_fit_afterwards(contents: Contents) -> None:
    entity, component = "/bench/rays/L1", "LineStrips3D:strips"
    ((before, _),) = contents.shown(entity, component, "capture", LAST[STANDOFFS[-1]])
    ((after, end),) = contents.shown(entity, component, "capture", CAPTURES)
    assert before == [-60.0, 0.0, 0.0]
    np.testing.assert_allclose(after, [-59.95, 0.0, 0.0], atol=1e-4)
    far_mm = BEYOND * TRIAL_STANDOFFS[-1]
    np.testing.assert_allclose(end, [-59.95 + 0.0011 * far_mm, 0.0, BEYOND * DRAWN_DEPTH_MM], atol=1e-2)


def test_rebuilt_recording_has_the_same_data(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "again.rrd"
    out.write_bytes(b"an older recording")
    rebuild(recorded.folder, recorded.rig, recorded.records, out)
    assert Contents(out).everything() == Contents(recorded.recording).everything()
    assert list(tmp_path.iterdir()) == [out]


def test_a_frame_that_lasers_share_is_logged_once(recorded: Recorded, tmp_path: Path) -> None:
    """As of beams of one emitter; captures 1 to 3 are made to show the frame of the first."""
    records: list[ev.Record] = []
    shared: dict[int, ev.CaptureTaken] = {}
    for number, record in enumerate(recorded.records):
        event = record.event
        if isinstance(event, ev.CaptureTaken) and len(shared) < 3:
            first = next(iter(shared.values()), event)
            event = event.model_copy(update={"on": first.on, "off": first.off})
            shared[number] = event
        records.append(record.model_copy(update={"event": event}))
    out = tmp_path / "shared.rrd"
    rebuild(recorded.folder, recorded.rig, records, out)
    contents = Contents(out)
    assert [number for number, _ in contents.values(IMAGE, FRAME)] == [1, *range(4, CAPTURES + 1)]
    assert [number for number, _ in contents.values("/spots/record", "u_px")][:4] == [1, 2, 3, 4]


def test_missing_frame_is_named_and_the_old_recording_stays(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "again.rrd"
    out.write_bytes(b"an older recording")
    with pytest.raises(BadInputError, match=r"frames/c0001-on\.png: "):
        rebuild(tmp_path, recorded.rig, recorded.records, out)
    assert out.read_bytes() == b"an older recording"
    assert list(tmp_path.iterdir()) == [out]


def test_changed_frame_is_named(recorded: Recorded, tmp_path: Path) -> None:
    first = next(r.event for r in recorded.records if isinstance(r.event, ev.CaptureTaken)).on
    damaged = tmp_path / first.path
    damaged.parent.mkdir()
    damaged.write_bytes((recorded.folder / first.path).read_bytes()[:-100])
    with pytest.raises(BadInputError, match=r"frames/c0001-on\.png: .*sha256"):
        rebuild(tmp_path, recorded.rig, recorded.records, tmp_path / "again.rrd")


def test_first_record_must_name_the_session(recorded: Recorded, tmp_path: Path) -> None:
    with (
        RecordingConsumer(tmp_path, recorded.rig) as consumer,
        pytest.raises(ValueError, match="expected session_started"),
    ):
        consumer(recorded.records[1])


def test_every_event_has_its_way_of_being_logged() -> None:
    """One without would end the recording of a session, in which it is the first."""
    union, *_ = get_args(ev.Event)
    assert set(get_args(union)) <= set(OpenRecording.__dict__["_log"].dispatcher.registry)
