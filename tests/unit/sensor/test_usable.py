"""Use of an existing calibration: accepted fits of the same sensor only."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.exact import calibration_of
from tests.support.running import two_laser_rig
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.sensor.usable import check_same_sensor, load_usable

CALIBRATION = Path(__file__).parents[3] / "data/session-0.1.0/calibration.yaml"


def own_calibration() -> Calibration:
    """Calibration of `two_laser_rig`, with its name and serial number."""
    rig = two_laser_rig()
    exact = calibration_of(rig)
    made = exact.laser_ranger.provenance.model_copy(update={"rig": rig.rig, "serial": rig.serial})
    return exact.model_copy(
        update={"laser_ranger": exact.laser_ranger.model_copy(update={"provenance": made})}
    )


@pytest.mark.parametrize(
    "change",
    [
        {"rig": "another"},
        {"serial": "emulated-9"},
        {"lasers": ()},
        {"camera": {"width_px": 320}},
        {"camera": {"lens": "equidistant"}},
    ],
)
def test_a_calibration_of_another_sensor_is_refused(change: dict[str, object]) -> None:
    rig, own = two_laser_rig(), own_calibration()
    check_same_sensor(rig, own)
    if isinstance(camera := change.get("camera"), dict):
        change = {"camera": rig.camera.model_copy(update=camera)}
    with pytest.raises(BadInputError):
        check_same_sensor(rig.model_copy(update=change), own)


@pytest.mark.parametrize(("because", "refused"), [("", True), ("the only one there is", False)])
def test_a_refused_fit_is_usable_with_a_reason_only(tmp_path: Path, because: str, refused: bool) -> None:
    text = CALIBRATION.read_text()
    for old, new in (
        ('verdict: "accepted"', 'verdict: "refused"'),
        ('accepted_because: ""', f'accepted_because: "{because}"'),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    file = tmp_path / "c.yaml"
    file.write_text(text)
    if refused:
        with pytest.raises(BadInputError, match=str(file)):
            load_usable(file)
    else:
        assert load_usable(file).laser_ranger.fit.accepted_because == because
