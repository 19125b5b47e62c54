"""A whole session on the virtual bench with a fisheye of 120 degrees: calibration, file, accuracy trial."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml as pyyaml

from tests.crash.short import CALLER, write_files
from tests.support.virtual_truth import parameter_values
from workbench.model.calibration import load_calibration
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run

CAMERA = """\
camera:
  width_px: 640
  height_px: 480
  lens: equidistant
  f_px: {value: 305.6, sd: 15.0}
  cx_px: {value: 319.5, sd: 10.0}
  cy_px: {value: 239.5, sd: 10.0}
  k1: {value: 0.0, sd: 0.05}
  k2: {value: 0.0, sd: 0.02}
  k3: {value: 0.0, sd: 0.01}
  k4: {value: 0.0, sd: 0.005}

"""
PROCEDURE = """\
format: 1
procedure: fisheye
title: Fisheye
steps:
  - step: capture_grid
    standoffs_mm: [50, 80, 150, 400, 900]
    repeats: 2
  - step: fit
    limits: {max_relative_range_sd: 0.1}
  - step: export
  - step: accuracy_trial
    standoffs_mm: [60, 250]
    readings: 2
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fisheye")
    rig, procedure = write_files(folder, PROCEDURE)
    text = re.sub(r"camera:\n(  .*\n)+\n", CAMERA, rig.read_text())
    rig.write_text(text.replace("bench:\n", "bench:\n  reach_mm: [40.0, 2000.0]\n"))
    run(Plan.load(rig, [procedure]), folder / "s", (), CALLER, lambda: None)
    return folder / "s"


def test_the_truth_lies_where_the_calibration_says(session: Path) -> None:
    calibration = load_calibration(session / "calibration.yaml")
    assert calibration.distortion_model == "equidistant"
    assert calibration.laser_ranger.fit.verdict == "accepted"
    truth: dict[str, Any] = pyyaml.safe_load(session.with_name("s.truth.yaml").read_text())
    assert truth["lens"] == "equidistant"
    parameters = calibration.laser_ranger.parameters
    values = parameter_values(truth)
    true = [values[name] for name in parameters.names]
    error, free = np.array(parameters.values) - true, np.array(parameters.sd) > 0
    covariance = parameters.covariance_array[np.ix_(free, free)]
    distance2, n = error[free] @ np.linalg.solve(covariance, error[free]), int(free.sum())
    # Chi-square of n degrees of freedom, variance 2 n: four deviations.
    assert distance2 < n + 4 * np.sqrt(2 * n)


def test_ranges_at_standoffs_that_it_has_not_seen_are_as_good_as_stated(session: Path) -> None:
    (table,) = (path for path in session.glob("fisheye.*.csv") if "-" not in path.stem)
    trial = pd.read_csv(table)
    assert (trial["readings"].tolist(), trial["missing"].tolist()) == ([2, 2], [0, 0])
    error, own_sd, reference_sd, standoff = (
        trial[["mean_error_mm", "range_sd_mm", "reference_sd_mm", "standoff_mm"]].to_numpy(float).T
    )
    assert (np.abs(error) < 4 * np.hypot(own_sd, reference_sd)).all()
    assert (own_sd < 0.02 * standoff).all()
