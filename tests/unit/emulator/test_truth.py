"""The truth is drawn from the rig's tolerances, kept by key, and written beside the session."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from tests.support.ideal import FISHEYE, exact, ideal_rig, laser, scene_of
from tests.support.virtual_bench import THESIS, read_truth
from workbench.emulator.spec import emulator_spec
from workbench.emulator.truth import Truth, draw_placement_error, draw_truth
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import Placement


def truth_of(seed: int, **pins: Any) -> Truth:
    rig = THESIS.model_copy(update={"emulator": {"seed": seed, "truth": pins}})
    return draw_truth(rig, emulator_spec(rig))


def test_truths_follow_the_tolerances() -> None:
    truths = [truth_of(seed) for seed in range(300)]
    scores = {
        "f": [(t.f_px - 533.3) / 26.7 for t in truths],
        "cx": [(t.cx_px - 319.5) / 40 for t in truths],
        "offset": [t.offset_mm / 5 for t in truths],
        "scale": [t.ruler_scale / 0.0005 for t in truths],
        "common yaw": [t.target_yaw_deg / 0.5 for t in truths],
        "common pitch": [t.target_pitch_deg / 0.5 for t in truths],
        "L1 x": [(t.lasers["L1"].x_mm + 60) / 0.2 for t in truths],
        "L4 ty": [t.lasers["L4"].ty / 0.005 for t in truths],
    }
    for name, values in scores.items():
        assert kstest(values, "norm").pvalue > 1e-3, name
    assert abs(np.corrcoef(scores["f"], scores["offset"])[0, 1]) < 0.2


def test_no_drawn_lens_folds() -> None:
    for seed in range(100):
        truth = truth_of(seed)
        r = np.linspace(0, 1.2, 200)
        height = r * (1 + truth.k1 * r**2 + truth.k2 * r**4)
        corner = np.hypot(640 - truth.cx_px, 480 - truth.cy_px) / truth.f_px
        reached = height[: int(np.argmax(height >= corner)) + 1] if height.max() >= corner else height
        assert np.all(np.diff(reached) > 0)


def test_a_pin_leaves_the_others_as_they_were() -> None:
    free, pinned = truth_of(5), truth_of(5, f_px=541.0, lasers={"L2": {"tx": 0.001}})
    assert pinned.f_px == 541.0
    assert pinned.lasers["L2"].tx == 0.001
    assert pinned.lasers["L2"].ty == free.lasers["L2"].ty
    assert (pinned.cx_px, pinned.offset_mm, pinned.lasers["L1"]) == (
        free.cx_px,
        free.offset_mm,
        free.lasers["L1"],
    )


def test_placement_errors_follow_their_tolerances_and_keys() -> None:
    spec = emulator_spec(THESIS)
    errors = [draw_placement_error(THESIS, spec, f"P{i}") for i in range(400)]
    for values in (
        [e.error_mm / 0.3 for e in errors],
        [e.yaw_deg / 0.5 for e in errors],
        [e.pitch_deg / 0.5 for e in errors],
    ):
        assert kstest(values, "norm").pvalue > 1e-3
    assert draw_placement_error(THESIS, spec, "P7") == errors[7]


def test_another_truth_begins_its_file_anew(tmp_path: Path) -> None:
    scene_of(ideal_rig(seed=1), tmp_path).place(Placement(key="old", standoff_mm=500.0))
    scene_of(ideal_rig(laser("L2", 30.0), seed=2), tmp_path).place(Placement(key="new", standoff_mm=500.0))
    assert set(read_truth(tmp_path / "truth.yaml")["placements"]) == {"new"}


def test_a_torn_line_is_dropped(tmp_path: Path) -> None:
    scene_of(ideal_rig(), tmp_path).place(Placement(key="A", standoff_mm=500.0))
    with (tmp_path / "truth.yaml").open("a") as file:
        file.write('  "B": {error_mm: 0.')
    scene_of(ideal_rig(), tmp_path)
    assert set(read_truth(tmp_path / "truth.yaml")["placements"]) == {"A"}


def test_an_exact_rig_has_an_exact_truth() -> None:
    rig: Rig = ideal_rig(camera={"k1": exact(-0.1)})
    truth = draw_truth(rig, emulator_spec(rig))
    assert (truth.k1, truth.f_px, truth.lasers["L1"].x_mm) == (-0.1, 533.3, 60.0)


def test_no_other_room_knows_the_truth() -> None:
    rooms = Path(__file__).parents[3] / "workbench"
    strangers = [path for path in rooms.rglob("*.py") if "emulator" not in path.relative_to(rooms).parts]
    assert len(strangers) > 10
    for path in strangers:
        text = path.read_text(encoding="utf-8")
        assert "truth.yaml" not in text, path
        assert "emulator.truth" not in text, path


def test_a_fisheye_that_does_not_reach_the_corner_is_refused() -> None:
    rig = ideal_rig(camera=FISHEYE, truth={"k1": -0.4})
    with pytest.raises(BadInputError, match="k1, k2, k3, k4"):
        draw_truth(rig, emulator_spec(rig))


def test_a_lens_that_folds_is_refused() -> None:
    rig = ideal_rig(truth={"k1": -2.0})
    with pytest.raises(BadInputError, match=r"emulator\.truth: "):
        draw_truth(rig, emulator_spec(rig))


def test_an_angle_with_a_stated_uncertainty_has_that_deviation() -> None:
    spec = emulator_spec(THESIS)
    own = [draw_placement_error(THESIS, spec, f"P{i}", (0.1, None)) for i in range(400)]
    usual = [draw_placement_error(THESIS, spec, f"P{i}") for i in range(400)]
    scale = 0.1 / THESIS.bench.tilt_sd_deg
    assert [one.yaw_deg for one in own] == pytest.approx([scale * one.yaw_deg for one in usual])
    assert [one.pitch_deg for one in own] == [one.pitch_deg for one in usual]
    assert [one.error_mm for one in own] == [one.error_mm for one in usual]
