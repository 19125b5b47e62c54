"""The recording holds what the records say, no more and no less."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents
from tests.viewer.session import (
    BAD,
    LASERS,
    READINGS,
    REPEATS,
    SESSION,
    STANDOFFS,
    TRIAL_STANDOFFS,
    a_fit,
)
from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.fit_tables import cross_validation_table, parameter_table, term_table
from workbench.viewer.recording import RecordingConsumer, _OpenRecording, rebuild
from workbench.viewer.table_text import table_text

CAPTURES = len(LASERS) * len(STANDOFFS) * REPEATS + len(TRIAL_STANDOFFS) * READINGS


@pytest.fixture(scope="module")
def contents(recorded: Recorded) -> Contents:
    return Contents(recorded.recording)


def test_names_the_session_and_brings_its_layout(recorded: Recorded) -> None:
    reader = RrdReader(str(recorded.recording))
    (recording,) = reader.recordings()
    assert (recording.application_id, recording.recording_id) == ("workbench", SESSION)
    (layout,) = reader.blueprints()
    assert layout.application_id == "workbench"


def test_holds_every_frame_with_lasers_on_byte_for_byte(recorded: Recorded, contents: Contents) -> None:
    taken = [r.event for r in recorded.records if isinstance(r.event, ev.CaptureTaken)]
    frames = contents.values("/bench/camera/image", "EncodedImage:blob")
    assert [number for number, _ in frames] == list(range(1, CAPTURES + 1))
    assert [png for _, png in frames] == [(recorded.folder / one.on.path).read_bytes() for one in taken]


def test_frames_and_spots_stand_at_the_exposure(recorded: Recorded, contents: Contents) -> None:
    taken = [r.event for r in recorded.records if isinstance(r.event, ev.CaptureTaken)]
    exposures = [np.datetime64(one.on.time_ns, "ns") for one in taken]
    for entity, component in (
        ("/bench/camera/image", "EncodedImage:media_type"),
        ("/bench/camera/spots", "Points2D:positions"),
    ):
        times = dict(contents.values(entity, component, "time"))
        assert [np.datetime64(time) for time in times] == exposures


@pytest.mark.parametrize("laser", LASERS)
@pytest.mark.parametrize("quantity", ["u_px", "v_px", "u_sd_px", "v_sd_px", "flux_dn", "width_px", "peak_dn"])
def test_spots_are_logged_to_the_last_bit(
    recorded: Recorded, contents: Contents, laser: str, quantity: str
) -> None:
    found = [r.event for r in recorded.records if isinstance(r.event, ev.SpotsFound)]
    expected = [
        (number, [getattr(spot, quantity)])
        for number, event in enumerate(found, start=1)
        for spot in event.spots
        if spot.laser_id == laser
    ]
    assert contents.values(f"/spots/{quantity}/{laser}", "Scalars:scalars") == expected


def test_spots_are_drawn_where_they_are_in_reruns_pixels(recorded: Recorded, contents: Contents) -> None:
    found = [r.event for r in recorded.records if isinstance(r.event, ev.SpotsFound)]
    drawn: dict[int, list[list[float]]] = {}
    for number, positions in contents.values("/bench/camera/spots", "Points2D:positions"):
        drawn.setdefault(number, positions)
    for positions, event in zip(drawn.values(), found, strict=True):
        expected = [(spot.u_px + 0.5, spot.v_px + 0.5) for spot in event.spots]
        np.testing.assert_allclose(positions, expected, atol=1e-4)
    labels = contents.values("/bench/camera/spots", "Points2D:labels")
    assert labels[0][1] == ["L1"]
    assert labels[-1][1] == list(LASERS)


def test_target_moves_with_the_capture_that_it_is_placed_for(contents: Contents) -> None:
    first = [1 + i * len(LASERS) * REPEATS for i in range(len(STANDOFFS))]
    first += [33 + i * READINGS for i in range(len(TRIAL_STANDOFFS))]
    expected = [(n, [s]) for n, s in zip(first, (*STANDOFFS, *TRIAL_STANDOFFS), strict=True)]
    assert contents.values("/target/standoff_mm", "Scalars:scalars") == expected


def test_parameters_carry_what_determined_them(contents: Contents) -> None:
    for one in a_fit().parameters:
        entity = "/fit/parameters/" + one.name
        logged = {
            name: contents.values(entity, component)[0][1]
            for name, component in {
                "value": "Measurements:values",
                "variance": "Measurements:variances",
                "prior_sd": "prior_sd",
                "data_share": "data_share",
                "by": "determined_by",
            }.items()
        }
        assert logged == {
            "value": [one.value],
            "variance": [one.sd**2],
            "prior_sd": [one.prior_sd],
            "data_share": [one.data_share],
            "by": [one.determined_by],
        }


def test_residuals_have_a_standoff_timeline_and_the_bad_one_is_named(contents: Contents) -> None:
    for laser in LASERS:
        expected = [(round(r.standoff_mm), [r.u_px]) for r in a_fit().residuals if r.laser_id == laser]
        entity = f"/fit/residuals/u_px/{laser}"
        assert contents.values(entity, "Scalars:scalars", "standoff_mm") == expected
    ((_, labels),) = contents.values("/fit/chart/u/outliers", "Points2D:labels")
    assert labels == [f"{BAD[0]} at {BAD[1]:g} mm: 4.8 sigma"]
    assert "/fit/chart/v/outliers" not in contents.entities


def test_the_fit_is_summed_up_in_words(contents: Contents) -> None:
    texts = [text for _, (text,) in contents.values("/fit/summary", "TextDocument:text")]
    assert texts[0] == "No fit yet"
    assert texts[-1].startswith("**Calibration accepted**")
    assert "f_px is determined by the prior" in texts[-1]
    table = contents.values("/fit/parameter_table", "TextDocument:text")[-1][1][0]
    assert table == table_text(parameter_table(a_fit().parameters))
    checks = contents.values("/fit/checks", "TextDocument:text")[-1][1][0]
    fit = a_fit()
    for part in (cross_validation_table(fit.left_out), term_table(fit.terms)):
        assert table_text(part) in checks


@pytest.mark.parametrize(
    ("entity", "standoffs", "unit"), [("fit/chart/u", STANDOFFS, "px"), ("trial/chart", TRIAL_STANDOFFS, "%")]
)
def test_a_chart_labels_every_standoff_and_says_its_units(
    contents: Contents, entity: str, standoffs: tuple[float, ...], unit: str
) -> None:
    labels = contents.values(f"/{entity}/ticks", "Points2D:labels")[-1][1]
    assert {f"{standoff:g}" for standoff in standoffs} <= set(labels)
    assert sum(label.endswith(f" {unit}") for label in labels) >= 4
    (title,) = [label for label in labels if "against" in label]
    assert f"[{unit}] against standoff [mm]" in title


def test_readings_and_the_trial_table(recorded: Recorded, contents: Contents) -> None:
    readings = [r.event for r in recorded.records if isinstance(r.event, ev.ReadingTaken)]
    errors = contents.values("/trial/errors/sensor", "Measurements:values")
    assert [value for _, (value,) in errors] == [(one.range_mm or 0.0) - one.standoff_mm for one in readings]
    bands = contents.values("/trial/errors/L2", "Measurements:variances")
    assert [value for _, (value,) in bands] == [one.lasers[1].sigma_mm ** 2 for one in readings]
    table = contents.values("/trial/summary", "TextDocument:text")[-1][1][0]
    (finished,) = [r.event for r in recorded.records if isinstance(r.event, ev.TrialFinished)]
    assert table.startswith("Trial accuracy-flat")
    assert all(table_text(one) in table for one in finished.tables)


def test_lanes_and_log_follow_the_steps(contents: Contents) -> None:
    steps = contents.values("/steps/lanes/step", "StateChange:state", "step")
    assert [number for number, _ in steps] == [*range(1, 10), 9]
    assert [state for _, (state,) in steps][:2] == ["Capture at 200 mm", "Capture at 500 mm"]
    log = [text for _, (text,) in contents.values("/steps/log", "TextLog:text", "time")]
    assert log[0].startswith(f"Session {SESSION} on made-up")
    assert log[-1] == "Session ended (0): done"


def test_rays_are_drawn_from_the_priors_and_again_from_the_fit(contents: Contents) -> None:
    before, after = contents.values("/bench/rays/L1", "LineStrips3D:strips")
    assert before[1][0][0] == [-60.0, 0.0, 0.0]
    np.testing.assert_allclose(after[1][0][0], [-59.95, 0.0, 0.0], atol=1e-4)
    np.testing.assert_allclose(after[1][0][1], [-59.95 + 0.0011 * 5000, 0.0, 5000.0], atol=1e-2)


def test_rebuilt_recording_has_the_same_data(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "again.rrd"
    out.write_bytes(b"an older recording")
    rebuild(recorded.folder, recorded.rig, recorded.records, out)
    assert Contents(out).everything() == Contents(recorded.recording).everything()
    assert list(tmp_path.iterdir()) == [out]


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
    assert set(get_args(union)) <= set(_OpenRecording.__dict__["_log"].dispatcher.registry)
