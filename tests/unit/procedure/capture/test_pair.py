"""One capture: taken and stored, or served from disk; and beams that burn when they should not."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.plain_bench import plain_bench
from tests.support.running import two_laser_rig
from tests.support.scanned_head import inclined_rig
from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import Bench, ExposableCamera, Frame
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError
from workbench.model.event import CaptureTaken, ExposureSet, TargetPlaced
from workbench.model.rig import load_rig
from workbench.model.target import Placement
from workbench.procedure.capture.pair import PairSource, spots_found
from workbench.session.state import PlacementCaptures
from workbench.spots import Failure, Finding, find_spots

PLACEMENT = Placement(key="p.1/500mm", standoff_mm=500.0, standoff_sd_mm=1.5)
KEY = "p.1/500mm/L1/00"
HEAD_RIG = Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml"
SET = ExposureSet(key=PLACEMENT.key, exposure=20.0, unit="us", peak=0.6, verdict="good", trials=3)


@pytest.fixture
def source(tmp_path: Path) -> Iterator[PairSource]:
    """A bench with the target placed, and beams confirmed to be safe."""
    rig = two_laser_rig()
    with plain_bench(rig, tmp_path) as bench:
        bench.target.place(PLACEMENT)
        yield PairSource(tmp_path, rig, bench, may_emit=True)


def take(source: PairSource, *ids: str, scene: str | None = None) -> CaptureTaken:
    return source.pair(KEY, ids or ("L1",), PLACEMENT, 0, scene)[2]


def test_a_pair_is_stored_with_placement_and_exposure(source: PairSource) -> None:
    found = source.set_exposure(PLACEMENT, lambda key: None)
    assert found is not None
    taken = take(source)
    assert (taken.laser_id, taken.placement_key) == ("L1", PLACEMENT.key)
    assert (taken.standoff_mm, taken.standoff_sd_mm) == (500.0, 1.5)
    assert (taken.exposure, taken.exposure_unit) == (found.exposure, found.unit)
    assert (taken.purpose, take(source, "L1", "L2", scene="a").purpose) == ("calibration", "trial")
    assert take(source, "L1", "L2").laser_id == "all"
    assert taken.lit_s is not None
    assert taken.lit_s > 0


def test_the_exposure_may_follow_the_brightness_within_its_limits(source: PairSource) -> None:
    found = source.set_exposure(PLACEMENT, lambda key: None)
    assert found is not None
    source.change_exposure(found.exposure / 2)
    assert take(source).exposure == found.exposure / 2
    assert isinstance(source.bench.camera, ExposableCamera)
    assert source.bench.camera.exposure_limits is not None
    source.change_exposure(1e12)
    assert take(source).exposure == source.bench.camera.exposure_limits[1]


def test_a_replay_changes_no_exposure(source: PairSource) -> None:
    source.set_exposure(PLACEMENT, lambda key: None)
    before = take(source).exposure
    source.replayed = PlacementCaptures(TargetPlaced(placement=PLACEMENT), SET)
    source.change_exposure(1.0)
    source.replayed = None
    assert take(source).exposure == before


def test_every_trial_exposure_is_named_before_it_is_taken(source: PairSource) -> None:
    named: list[str] = []
    found = source.set_exposure(PLACEMENT, named.append)
    assert found is not None
    assert named == [f"{PLACEMENT.key}/exposure/{n:02d}" for n in range(found.trials)]


def test_a_frame_in_room_light_has_no_dark_frame_and_needs_no_confirmation(source: PairSource) -> None:
    source.may_emit = False
    image, taken = source.room_light("p.1/500mm/board/00", PLACEMENT, 0)
    assert image.shape == (120, 640)
    assert (taken.laser_id, taken.off, taken.lit_s) == ("board", None, None)


def test_nothing_fires_before_the_beams_are_confirmed_to_be_safe(source: PairSource) -> None:
    source.may_emit = False
    for fire in (lambda: take(source), lambda: source.set_exposure(PLACEMENT, lambda key: None)):
        with pytest.raises(RuntimeError):
            fire()


def test_a_frame_after_the_end_of_the_lease_is_taken_again(
    source: PairSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A computer that stalls while a laser is on: the lasers are off before the frame is exposed."""
    undisturbed = source.pair(KEY, ("L1",), PLACEMENT, 0, None)
    source.bench.mark("another")
    monkeypatch.setattr("workbench.procedure.capture.pair.LEASE_S", 0.5)
    grab, stalls = source.bench.camera.grab, iter([0.6])

    def stalled_grab() -> Frame:
        time.sleep(next(stalls, 0.0))
        return grab()

    monkeypatch.setattr(source.bench.camera, "grab", stalled_grab)
    on, off, taken = source.pair(KEY, ("L1",), PLACEMENT, 0, None)
    assert len(find_spots(on, off, expected=1).spots) == 1
    assert taken.lit_s is not None
    assert taken.lit_s < 0.5
    # A session on the virtual bench does not depend on the computer's load.
    assert np.array_equal(on, undisturbed[0])
    assert np.array_equal(off, undisturbed[1])


def test_a_whole_placement_is_served_from_disk(source: PairSource) -> None:
    on, off, taken = source.pair(KEY, ("L1",), PLACEMENT, 0, None)
    source.replayed = PlacementCaptures(TargetPlaced(placement=PLACEMENT), SET, {KEY: taken}, complete=True)
    source.may_emit = False
    assert source.set_exposure(PLACEMENT, lambda key: None) == SET
    again_on, again_off, again = source.pair(KEY, ("L1",), PLACEMENT, 0, None)
    assert again == taken
    np.testing.assert_array_equal(again_on, on)
    np.testing.assert_array_equal(again_off, off)
    with pytest.raises(BadInputError, match="p.1/500mm/L2/00".replace(".", r"\.")):
        source.pair("p.1/500mm/L2/00", ("L2",), PLACEMENT, 0, None)


def test_a_frame_that_changed_on_disk_is_refused(source: PairSource) -> None:
    taken = take(source)
    assert taken.off is not None
    source.replayed = PlacementCaptures(TargetPlaced(placement=PLACEMENT), None, {KEY: taken}, complete=True)
    path = source.session_dir / taken.on.path
    path.write_bytes((source.session_dir / taken.off.path).read_bytes())
    with pytest.raises(BadInputError, match="00-on") as caught:
        take(source)
    assert caught.value.exit_code == 2


class Stuck:
    """The camera of a bench in front of a beam that stays on."""

    def __init__(self, bench: Bench, laser_id: str) -> None:
        self.bench, self.laser_id = bench, laser_id

    def grab(self) -> Frame:
        with self.bench.lasers.lit([self.laser_id], for_s=2.0):
            return self.bench.camera.grab()

    grab_ambient = grab

    def close(self) -> None:
        self.bench.camera.close()


def test_a_beam_in_the_dark_frame_is_refused(source: PairSource) -> None:
    """Of a laser that no pair of its own shows: it burns in both frames of the others."""
    rig = source.rig
    with source.bench.lasers.lit(["L2"], for_s=2.0):
        stuck = source.bench.camera.grab().image
    line = prior_scanline(rig, rig.lasers[0])
    source.check_dark(KEY, stuck, find_spots(stuck, scanlines=[line], expected=1), [line])
    source.bench = replace(source.bench, camera=Stuck(source.bench, "L2"))
    with pytest.raises(LaserOffNotConfirmedError, match=KEY) as caught:
        source.check_stuck_beam(KEY)
    assert caught.value.exit_code == 7
    assert "measure_latency" in str(caught.value)
    source.check_stuck_beam(KEY)  # the frame was looked at: nothing is left


@pytest.mark.parametrize("reading_deg", [0.0, -30.0])
def test_a_turned_head_is_exposed_and_its_stuck_beam_found_at_its_reading(
    tmp_path: Path, reading_deg: float
) -> None:
    rig = inclined_rig(load_rig(HEAD_RIG))
    turned = PLACEMENT.model_copy(update={"head_deg": reading_deg})
    with plain_bench(rig, tmp_path) as bench:
        bench.target.place(turned)
        source = PairSource(tmp_path, rig, bench, may_emit=True)
        found = source.set_exposure(turned, lambda key: None)
        assert found is not None
        assert found.verdict == "good"
        source.pair(KEY, ("S",), turned, 0, "scene")
        source.bench = replace(bench, camera=Stuck(bench, "S"))
        stuck = source.bench.camera.grab().image
        line = prior_scanline(rig, rig.head_laser, reading_deg)
        source.check_dark(KEY, stuck, find_spots(stuck, scanlines=[line], expected=1), [line])
        with pytest.raises(LaserOffNotConfirmedError):
            source.check_stuck_beam(KEY)


def test_one_spot_of_a_laser_alone_is_the_lasers(source: PairSource) -> None:
    on, off, _ = source.pair(KEY, ("L1",), PLACEMENT, 0, None)
    finding = find_spots(on, off, scanlines=[prior_scanline(source.rig, source.rig.lasers[0])], expected=1)
    (spot,) = finding.spots
    (record,) = spots_found(KEY, finding, ["L1"]).spots
    assert (record.laser_id, record.u_px, record.v_sd_px) == ("L1", spot.u_px, spot.v_sd_px)
    twice = Finding((spot, spot), (Failure.TOO_MANY,))
    assert [one.laser_id for one in spots_found(KEY, twice, ["L1"]).spots] == [None, None]
    assert [one.laser_id for one in spots_found(KEY, finding, ["L1", "L2"]).spots] == [None]
    assert spots_found(KEY, twice, ["L1"]).failures == ("too_many",)
