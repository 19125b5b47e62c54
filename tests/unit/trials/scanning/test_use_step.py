"""Step `use_head`: the head's file is included, mistakes have their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE
from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.export import calibrated_head, render
from workbench.calibration.scanning.fit import fit_head
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.model.yamlfile import standalone_text
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.procedure_file import Procedure, load_procedure
from workbench.trials.scanning.use_step import UseHeadStep

ROOT = Path(__file__).parents[4]
PROCEDURE = """\
format: 1
procedure: p
title: T
steps:
  - step: use_head
    file: old/head.yaml
  - {step: scan, standoff_mm: 500, from_deg: -10, to_deg: 10, step_deg: 5}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("use")
    head = SimulatedHead.of(load_rig(ROOT / "rigs/scanning-head-emulated.yaml"), 2)
    spots = head.spots((300.0, 700.0), (0.0, -10.0, -20.0), 0.05, np.random.default_rng(2))
    (folder / "old").mkdir()
    (folder / "old/head.yaml").write_text(render(calibrated_head(fit_head(head.rig, spots), PROVENANCE)))
    (folder / "p.yaml").write_text(PROCEDURE)
    return folder


def test_the_head_is_included_relative_to_the_procedure(folder: Path) -> None:
    use = load_procedure(folder / "p.yaml").steps[0]
    assert isinstance(use, UseHeadStep)
    assert use.file.scanning_head.laser == "S"
    assert PROVENANCE.session in use.title
    assert "old/head.yaml" not in standalone_text(folder / "p.yaml", Procedure)


def test_it_gives_what_a_scan_needs(folder: Path) -> None:
    found = check_file(folder / "p.yaml")
    assert (found.mistakes, found.notes) == ((), ())
    (found_note,) = check_file(ROOT / "procedures/scan-shape.yaml").notes
    assert "scan needs an earlier procedure in the same command that gives head" in found_note


def test_a_missing_or_wrong_file_is_named_with_the_line(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "p.yaml").write_text(PROCEDURE)
    with pytest.raises(BadInputError, match=r"p.yaml:6: file: the head's file old/head.yaml cannot be used"):
        load_procedure(tmp_path / "p.yaml")
    (tmp_path / "old/head.yaml").write_text("rig: x\n")
    with pytest.raises(BadInputError, match="expected a calibration of a scanning head"):
        load_procedure(tmp_path / "p.yaml")
