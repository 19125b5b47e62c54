"""Step `export`."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from tests.support.running import running
from tests.support.steps import parse_step, wrong_keys
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError
from workbench.model.event import CalibrationExported

ACCEPTED = Path(__file__).parents[3] / "data/session-0.1.0/calibration.yaml"


@pytest.mark.parametrize(
    "file", ["best.yaml", "calibration.yml", "../calibration.yaml", "calibration/a.yaml"]
)
def test_the_file_is_a_calibration_in_the_session_folder(file: str) -> None:
    assert wrong_keys(f"step: export, file: {file}") == ["steps[0].file"]
    assert wrong_keys("step: export, file: calibration-2.yaml") == []


def test_it_makes_a_calibration_of_a_fit() -> None:
    step = parse_step("step: export")
    assert (step.needs, step.gives, step.file) == ("fit", "calibration", "calibration.yaml")
    assert step.default_duration_s == 1.0


def test_the_accepted_calibration_is_written_and_its_hash_journalled(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        context = session.context
        context.accepted = load_calibration(ACCEPTED)
        parse_step("step: export, file: calibration-2.yaml").run(context, "p.3")
        path = context.session_dir / "calibration-2.yaml"
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        assert session.events == [CalibrationExported(path="calibration-2.yaml", sha256=sha256)]
        assert load_calibration(path) == context.accepted == context.calibration


def test_without_a_fit_there_is_nothing_to_export(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        with pytest.raises(BadInputError, match=r"p\.3"):
            parse_step("step: export").run(session.context, "p.3")
        assert not (session.context.session_dir / "calibration.yaml").exists()
        assert session.context.calibration is None
