"""Wrong arguments of every public function: a result or an error of the project, never one of Python."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from workbench.api.arguments import millimetres_of, names_of, whole_of

ROOT = Path(__file__).parents[3]
FOLDER, CALIBRATION = ROOT / "data/session-0.1.0", ROOT / "data/session-0.1.0/calibration.yaml"
ROWS, RIG = ROOT / "data/webcam-laser-rows.csv", ROOT / "rigs/webcam-laser.yaml"
WRONG: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    3200,
    2.5,
    nan,
    inf,
    10**400,
    1e300,
    "a" * 5000,
    Path("b" * 300),
    "\ud800",
    np.array("k1"),
    np.array(5),
    np.array([None, "k1"]),
    1j,
    "",
    " ",
    "no/such/file",
    "\0",
    b"",
    b"bytes",
    Path("no/such/file"),
    [],
    [nan],
    [-1],
    [1.0, "a"],
    [[1], [2, 3]],
    {"a": 1},
    {1, 2},
    object(),
    np.zeros(0),
    np.zeros((2, 2)),
    np.zeros((2, 2), np.uint8),
    pd.DataFrame(),
    pd.DataFrame({"laser_id": ["1"], "standoff_mm": ["x"], "repeat": [None]}),
    pd.Series({"capture": [], "u_px": nan, "v_px": inf}),
)
SESSION = wb.open_session(FOLDER)
LOADED = wb.load_calibration(CALIBRATION)
CALLS: dict[str, Callable[[Any], object]] = {
    "open_session(folder)": wb.open_session,
    "sessions(folder)": wb.sessions,
    "fit(captures)": lambda x: wb.fit(x, RIG),
    "fit(rig)": lambda x: wb.fit("no/such/file", x),
    "fit(fix)": lambda x: wb.fit("no/such/file", RIG, fix=x),
    "load_calibration(path)": wb.load_calibration,
    "compare(a)": lambda x: wb.compare(x, LOADED),
    "compare(b)": lambda x: wb.compare(LOADED, x),
    "design(rig)": wb.design,
    "design(standoffs)": lambda x: wb.design(RIG, standoffs=[1000.0] if x is None else x),
    "design(count)": lambda x: wb.design(RIG, count=x),
    "design(repeats)": lambda x: wb.design(RIG, standoffs=[1000.0], repeats=x),
    "simulate(rig)": lambda x: wb.simulate(x, n=1, standoffs=[300.0, 1000.0], ranges_mm=[500.0]),
    "simulate(n)": lambda x: wb.simulate("no/such/file", n=x),
    "simulate(seed)": lambda x: wb.simulate("no/such/file", seed=x),
    "simulate(standoffs)": lambda x: wb.simulate("no/such/file", standoffs=x),
    "simulate(repeats)": lambda x: wb.simulate("no/such/file", repeats=x),
    "simulate(ranges_mm)": lambda x: wb.simulate("no/such/file", ranges_mm=x),
    "with_prior(rig)": lambda x: wb.with_prior(x, "f_px"),
    "with_prior(name)": lambda x: wb.with_prior(RIG, x),
    "with_prior(value)": lambda x: wb.with_prior(RIG, "f_px", value=x),
    "with_prior(sd)": lambda x: wb.with_prior(RIG, "f_px", sd=x),
    "draw(chart)": wb.draw,
    "Ranger(calibration)": wb.Ranger,
    "Ranger(shape_prior)": lambda x: wb.Ranger(LOADED, x),
    "ShapePrior(flat)": lambda x: wb.ShapePrior(flat=x),
    "ShapePrior(slope_sds)": lambda x: wb.ShapePrior(slope_sds=x),
    "Ranger.range(scene)": lambda x: wb.Ranger(LOADED).range(np.zeros((480, 640), np.uint8), None, x),
    "Ranger.range(on)": wb.Ranger(LOADED).range,
    "Ranger.range(off)": lambda x: wb.Ranger(LOADED).range(np.zeros((480, 640), np.uint8), x),
    "Calibration.range_uncertainty(ranges_mm)": LOADED.range_uncertainty,
    "Calibration.save(path)": LOADED.save,
    "Calibration.accept(reason)": LOADED.accept,
    "Session.captures_for_fit(without)": SESSION.captures_for_fit,
    "Session.frame(capture)": SESSION.frame,
    "Session.crop(spot)": SESSION.crop,
    "Session.viewer(height_px)": SESSION.viewer,
    "Session.crop(half_px)": lambda x: SESSION.crop(SESSION.spots.iloc[0], x),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_a_wrong_argument_is_an_error_of_the_project(
    call: Callable[[Any], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = 0
    for value in WRONG:
        try:
            call(value)
        except wb.WorkbenchError:
            refused += 1
    assert refused > len(WRONG) / 2


def test_one_number_stands_for_a_list_of_it() -> None:
    one, several = LOADED.range_uncertainty(500), LOADED.range_uncertainty([500])
    pd.testing.assert_frame_equal(one, several)
    one, several = SESSION.captures_for_fit(without=1500), SESSION.captures_for_fit(without={1500.0})
    pd.testing.assert_frame_equal(one, several)


def test_a_path_stands_for_its_calibration() -> None:
    assert wb.Ranger(str(CALIBRATION)).calibration == LOADED
    assert wb.compare(CALIBRATION, LOADED).identical
    assert wb.compare(LOADED, str(CALIBRATION)).identical


@pytest.mark.parametrize(
    ("given", "expected"),
    [(500, (500.0,)), ([1, 2.5], (1.0, 2.5)), (np.arange(2), (0.0, 1.0)), (pd.Series([3]), (3.0,)), ([], ())],
)
def test_lengths_are_one_number_or_several(given: object, expected: tuple[float, ...]) -> None:
    assert millimetres_of("standoffs", given) == expected


def test_names_are_one_string_or_several() -> None:
    assert names_of("fix", "k1") == ("k1",)
    assert names_of("fix", ["k1", "k2"]) == ("k1", "k2")
    assert names_of("fix", ()) == ()
    assert names_of("fix", np.array(["k1", "k2"])) == ("k1", "k2")
    with pytest.raises(wb.BadInputError):
        names_of("fix", ["k1", 2])


def test_whole_numbers_have_a_least_value() -> None:
    assert whole_of("count", np.int64(1)) == 1
    assert whole_of("half_px", 0, least=0) == 0
    with pytest.raises(wb.BadInputError):
        whole_of("count", 0)
