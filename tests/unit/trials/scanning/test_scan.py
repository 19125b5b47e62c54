"""Calibration and scan of a head on the virtual bench, in this process; the same replayed in part."""

from __future__ import annotations

import csv
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.rigs import thesis_rig
from tests.support.running import running
from tests.support.scanned_head import SimulatedHead, inclined_rig
from workbench.calibration.data.observations import Observation
from workbench.devices.placed_by_hand import ByHandBlock, PlacedByHand
from workbench.model import event as ev
from workbench.model.errors import BadInputError, LimitFailedError, RigNotReadyError
from workbench.model.event import TrialFinished
from workbench.model.head_calibration import HeadCalibration
from workbench.model.prior import exactly
from workbench.model.rig import Rig, load_rig
from workbench.model.target import Placement
from workbench.model.yamlfile import load_yaml_model
from workbench.session.state import PlacementCaptures
from workbench.trials.scanning.calibrate_step import CalibrateHeadStep
from workbench.trials.scanning.moves import sweep
from workbench.trials.scanning.scan_step import ScanStep
from workbench.trials.scanning.use_step import UseHeadStep

RIG = Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml"
CALIBRATE = CalibrateHeadStep.model_validate(
    {
        "step": "calibrate_head",
        "standoffs_mm": [300, 600],
        "angles_deg": [0, 6, -6, -14, -22, -30, 40],
        "repeats": 2,
        "file": "head-low.yaml",
    }
)
SCAN = ScanStep.model_validate(
    {
        "step": "scan",
        "standoff_mm": 450,
        "target": {"shape": "cylinder", "diameter_mm": 178},
        "from_deg": -24,
        "to_deg": 4,
        "step_deg": 2,
    }
)


def low_rig() -> Rig:
    """The rig with a low picture, which is fast to draw, and a fixed exposure."""
    rig = load_rig(RIG)
    camera = rig.camera.model_copy(update={"height_px": 120, "cy_px": exactly(59.5)})
    return rig.model_copy(update={"camera": camera, "emulator": {"seed": 3}})


@dataclass(frozen=True)
class Done:
    folder: Path
    records: tuple[ev.Record, ...]
    head: HeadCalibration


def files(session: Path) -> dict[str, bytes]:
    """Results of a session."""
    return {path.name: path.read_bytes() for path in (*session.glob("*.csv"), session / "head-low.yaml")}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    folder = tmp_path_factory.mktemp("scan")
    with running(folder, low_rig()) as session:
        CALIBRATE.run(session.context, "c.1")
        SCAN.run(session.context, "c.2")
        assert session.context.head is not None
        return Done(folder, tuple(session.records), session.context.head)


def of_rig(head: HeadCalibration, rig: Rig) -> HeadCalibration:
    """The head with the provenance that a session of the rig gives it."""
    own = head.scanning_head
    provenance = own.provenance.model_copy(update={"rig": rig.rig, "serial": rig.serial})
    return HeadCalibration(scanning_head=own.model_copy(update={"provenance": provenance}))


def finished(records: tuple[ev.Record, ...]) -> dict[str, TrialFinished]:
    return {one.event.trial: one.event for one in records if isinstance(one.event, TrialFinished)}


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_every_capture_has_the_reading_of_the_encoder(done: Done) -> None:
    taken = [one.event for one in done.records if isinstance(one.event, ev.CaptureTaken)]
    assert len(taken) == CALIBRATE.captures(low_rig()) + SCAN.captures(low_rig())
    assert [one.head_deg for one in taken[:14:2]] == list(CALIBRATE.angles_deg)
    assert [one.head_deg for one in taken[28:]] == list(SCAN.angles_deg)


def test_the_file_is_that_of_the_session(done: Done) -> None:
    assert load_yaml_model(done.folder / "s/head-low.yaml", HeadCalibration) == done.head
    assert done.head.scanning_head.fit.noise_scale < 1.5
    moves = rows(done.folder / "s/c.1-moves.csv")
    assert len(moves) == done.head.scanning_head.fit.moves >= 10


def test_the_head_from_rendered_frames_is_the_true_one(done: Done) -> None:
    true = SimulatedHead.of(low_rig(), 3).values
    parameters = done.head.scanning_head.parameters
    free = np.array(parameters.sd) > 0
    z = (np.array(parameters.values) - true)[free]
    within = np.abs(z) / np.array(parameters.sd)[free]
    assert within.max() < 4.5
    # All together: the distance in the posterior's covariance has as many degrees of freedom.
    distance2 = z @ np.linalg.solve(parameters.covariance_array[np.ix_(free, free)], z)
    assert chi2.sf(distance2, free.sum()) > 1e-4


def test_a_fit_beyond_its_limits_calibrates_no_head(done: Done, tmp_path: Path) -> None:
    limits = {"rms_px": {"in": [None, 0.001]}}
    strict = CalibrateHeadStep.model_validate(CALIBRATE.model_dump(by_alias=True) | {"limits": limits})
    before = [one for one in done.records if not isinstance(one.event, TrialFinished)]
    shutil.copytree(done.folder / "s/frames/c.1", tmp_path / "s/frames/c.1")
    with running(tmp_path, low_rig(), before=before) as session:
        with pytest.raises(LimitFailedError, match=r"rms_px: expected at most 0\.001"):
            strict.run(session.context, "c.1")
        assert session.context.head is None
    assert not (tmp_path / "s/head-low.yaml").exists()
    assert (tmp_path / "s/c.1-parameters.csv").exists()


def test_a_beam_beyond_the_image_is_listed(done: Done) -> None:
    missing = rows(done.folder / "s/c.1-missing.csv")
    assert {float(row["reading_deg"]) for row in missing} >= {40.0}
    assert all(
        "expected one spot, got 0" in row["cause"] for row in missing if float(row["reading_deg"]) == 40
    )


def test_the_scan_finds_the_cylinder(done: Done) -> None:
    points = rows(done.folder / "s/c.2-points.csv")
    assert len(points) >= 8
    z = np.array([float(row["deviation_mm"]) / float(row["deviation_sd_mm"]) for row in points])
    assert np.abs(z).max() < 5.0
    for point in points:
        assert float(point["range_low_mm"]) < float(point["range_mm"]) < float(point["range_high_mm"])
        assert float(point["range_noise_mm"]) < float(point["range_sd_mm"])
    event = finished(done.records)["c.2"]
    summary = next(one for one in event.tables if one.name == "c.2-summary")
    (row,) = summary.records()
    assert (row["points"], row["missing"]) == (len(points), len(SCAN.angles_deg) - len(points))
    (chart,) = event.charts
    assert [one.name for one in chart.series] == ["stated target", "points, 1 sigma"]
    assert len(chart.series[1].x) == len(points)


def test_captures_of_a_turned_head_are_no_readings_of_a_fixed_laser(done: Done) -> None:
    assert not (done.folder / "s/trial-captures.csv").exists()
    assert not (done.folder / "s/captures.csv").exists()


def test_a_session_that_goes_on_has_the_same_results(done: Done, tmp_path: Path) -> None:
    """After a stop in the scan the calibration is replayed from disk."""
    before = [one for one in done.records if not isinstance(one.event, TrialFinished)]
    placed = [n for n, one in enumerate(before) if isinstance(one.event, ev.TargetPlaced)]
    shutil.copytree(done.folder / "s/frames/c.1", tmp_path / "s/frames/c.1")
    with running(tmp_path, low_rig(), before=before[: placed[-1]]) as session:
        CALIBRATE.run(session.context, "c.1")
        SCAN.run(session.context, "c.2")
    assert files(tmp_path / "s") == files(done.folder / "s")
    assert finished(tuple(session.records)) == finished(done.records)


def test_spots_of_an_inclined_beam_are_searched_where_the_head_is_turned(tmp_path: Path) -> None:
    """Turned by 30 degrees they are beyond the band of the reading 0; the same in a replay."""
    rig, angles_deg = inclined_rig(load_rig(RIG)), (0.0, -30.0)
    placed = Placement(key="c.1/400mm", standoff_mm=400.0, head_deg=0.0)
    with running(tmp_path, rig) as session:
        context = session.context
        context.confirm_safety()
        context.bench.target.place(placed)
        context.pairs.set_exposure(placed, lambda key: None)
        captures = sweep(context, placed, angles_deg, 1)
        assert [isinstance(one.found, Observation) for one in captures] == [True, True]
        taken = {one.key: one for one in context.captures}
        context.pairs.replayed = PlacementCaptures(ev.TargetPlaced(placement=placed), None, taken)
        assert sweep(context, placed, angles_deg, 1) == captures


def test_a_driver_without_an_encoder_is_named(tmp_path: Path) -> None:
    placed = Placement(key="c.1/400mm", standoff_mm=400.0, head_deg=0.0)
    with running(tmp_path, low_rig()) as session:
        context = session.context

        class NoEncoder:
            def place(self, placement: Placement) -> Placement:
                return placement.model_copy(update={"head_deg": None})

            def close(self) -> None:
                pass

        context.bench = replace(context.bench, target=NoEncoder())
        with pytest.raises(RigNotReadyError, match="must return head_deg"):
            sweep(context, placed, (0.0,), 1)


def test_a_scan_with_the_head_of_an_earlier_session(done: Done, tmp_path: Path) -> None:
    use = UseHeadStep(step="use_head", file=of_rig(done.head, low_rig()))
    with running(tmp_path, low_rig()) as session:
        use.run(session.context, "u.1")
        SCAN.model_copy(update={"step_deg": 14.0}).run(session.context, "u.2")
    assert (tmp_path / "s/u.2-points.csv").is_file()


def test_the_head_of_another_sensor_is_refused(done: Done, tmp_path: Path) -> None:
    other = low_rig().model_copy(update={"serial": "other"})
    use = UseHeadStep(step="use_head", file=of_rig(done.head, low_rig()))
    wanted = "serial: expected that of this rig, other, got emulated-4"
    with running(tmp_path, other) as session, pytest.raises(BadInputError, match=wanted):
        use.run(session.context, "u.1")


def test_a_scan_without_a_calibrated_head_says_what_to_do(tmp_path: Path) -> None:
    wanted = "calibrate_head step before it"
    with running(tmp_path, low_rig()) as session, pytest.raises(BadInputError, match=wanted):
        SCAN.run(session.context, "c.1")


def test_a_rig_without_head_or_reach_is_refused_before_the_session() -> None:
    with pytest.raises(BadInputError, match="expected a scanning head"):
        SCAN.placements("c.1", thesis_rig())
    rig = low_rig()
    short = rig.model_copy(update={"head": rig.scanning_head.model_copy(update={"reach_deg": (-10.0, 10.0)})})
    with pytest.raises(BadInputError, match="the head reaches -10 to 10 deg, got -14 deg"):
        CALIBRATE.placements("c.1", short)


def test_a_target_by_hand_cannot_turn_a_head() -> None:
    hand = PlacedByHand.open(ByHandBlock(), low_rig())
    assert hand.place(Placement(key="p", standoff_mm=300.0)).standoff_mm == 300.0
    with pytest.raises(RigNotReadyError, match="driver that turns the scanning head"):
        hand.place(Placement(key="p", standoff_mm=300.0, head_deg=0.0))
