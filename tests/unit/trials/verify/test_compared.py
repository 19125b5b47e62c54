"""Another calibration beside that of the session."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.four_lasers import calibrated
from tests.support.rangers import thesis_ranger
from tests.support.rigs import PROVENANCE, thesis_rig
from workbench.calibration.verdict.export import render
from workbench.model.errors import BadInputError
from workbench.trials.verify.compared import compared_sensor


def test_a_resumed_session_reads_its_copy(tmp_path: Path) -> None:
    file = tmp_path / "old.yaml"
    file.write_text(render(thesis_ranger().calibration))
    with calibrated(tmp_path) as session:
        context = session.context
        context.rig = thesis_rig().model_copy(update={"serial": PROVENANCE.serial})
        assert compared_sensor(context, "v.1", None) is None
        first = compared_sensor(context, "v.1", file)
        file.unlink()
        again = compared_sensor(context, "v.1", file)
    assert first is not None
    assert again is not None
    assert again.calibration == first.calibration


def test_the_calibration_of_another_sensor_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "old.yaml"
    file.write_text(render(thesis_ranger().calibration))
    with calibrated(tmp_path) as session:
        for wrong in (file, tmp_path / "none.yaml"):
            with pytest.raises(BadInputError) as caught:
                compared_sensor(session.context, "v.1", wrong)
            assert caught.value.exit_code == 2
