"""The public interface is what docs/api.md describes."""

from __future__ import annotations

import doctest
import importlib
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import workbench
from workbench.report import frames

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs/api.md"
DATA_FRAMES = {
    "sessions()": frames.SESSION_COLUMNS,
    "Session.captures": frames.CAPTURE_COLUMNS,
    "Session.spots": frames.SPOT_COLUMNS,
    "Session.residuals": frames.RESIDUAL_COLUMNS,
    "Session.cross_validation": frames.CROSS_VALIDATION_COLUMNS,
    "Session.readings": frames.READING_COLUMNS,
    "Calibration.parameters": frames.PARAMETER_COLUMNS,
    "Calibration.range_uncertainty()": frames.UNCERTAINTY_COLUMNS,
    "CalibrationComparison.differences": frames.DIFFERENCE_COLUMNS,
    "CalibrationDesign.parameters": frames.DESIGN_PARAMETER_COLUMNS,
    "CalibrationDesign.ranges": frames.DESIGN_RANGE_COLUMNS,
    "Simulation.parameters": frames.SIMULATED_PARAMETER_COLUMNS,
    "Simulation.ranges": frames.SIMULATED_RANGE_COLUMNS,
}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_documented_names_are_the_exported_ones() -> None:
    documented = re.findall(r"^\| `(\w+)[^|]*` \|", _section("# Python interface"), flags=re.MULTILINE)
    assert sorted(documented) == workbench.__all__
    assert sorted(importlib.import_module("workbench.api").__all__) == workbench.__all__


def test_documented_columns_are_those_of_the_data_frames() -> None:
    rows = re.findall(r"^\| `([^`]+)` \| [^|]+ \| ([^|]+) \|$", _section("## Sessions"), flags=re.MULTILINE)
    documented = {name: tuple(re.findall(r"`(\w+)`", columns)) for name, columns in rows}
    assert documented == DATA_FRAMES


@pytest.mark.parametrize("page", [PAGE, ROOT / "docs/how-to/ros-and-opencv.md"], ids=lambda page: page.stem)
def test_examples_of_the_page_run(page: Path) -> None:
    result = doctest.testfile(str(page), module_relative=False)
    assert result.failed == 0
    assert result.attempted > 10


@pytest.mark.parametrize("name", ["calibration", "priors", "ranger", "report", "session", "simulation"])
def test_examples_of_the_docstrings_run(name: str) -> None:
    result = doctest.testmod(importlib.import_module(f"workbench.api.{name}"))
    assert result.failed == 0
    assert result.attempted > 2


def test_example_script_runs(capsys: pytest.CaptureFixture[str]) -> None:
    main = runpy.run_path("examples/analysis/residuals.py")["main"]
    main("data/session-0.1.0", 1500.0)
    assert "difference_mm" in capsys.readouterr().out


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, workbench; print([m for m in ('numpy', 'pandas', 'jax') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    assert set(workbench.__all__) <= set(dir(workbench))
    assert not hasattr(workbench, "no_such_name")


def _section(heading: str) -> str:
    """Text from a heading up to the next one."""
    after = PAGE.read_text().partition(f"{heading}\n")[2]
    return after.partition("\n## ")[0]
