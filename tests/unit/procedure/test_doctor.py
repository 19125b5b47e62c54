"""Checks of a rig, part by part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.mjpeg import Stream
from tests.support.plain_bench import plain_bench
from tests.support.running import Scripted, two_laser_rig, with_emulator
from workbench.devices.protocols import StreamingCamera
from workbench.model.errors import StoppedError
from workbench.model.prompt import Answer
from workbench.model.rig import Rig
from workbench.procedure.capture.automatic import AutomaticControl
from workbench.procedure.doctor import examine, examine_rig


def noisy_rig(**emulator: object) -> Rig:
    """A camera without any noise delivers one number for every pixel, as a broken driver does."""
    return with_emulator(two_laser_rig(), sensor={}, **emulator)


LATER = ["latency", "exposure", "automatic control", "laser L1", "laser L2"]
PARTS = ["controller", "interlock", "camera", *LATER]


def results(folder: Path, rig: Rig, **camera: int) -> dict[str, bool]:
    """Whether each part is well; `camera` sets attributes of the driver before."""
    with plain_bench(rig, folder) as bench:
        for name, value in camera.items():
            setattr(bench.camera, name, value)
        found = {one.part: one.ok for one in examine(rig, bench, Scripted())}
        assert bench.lasers.state().lit == ()
    return found


def test_a_rig_that_is_ready_is_well_in_every_part(tmp_path: Path) -> None:
    assert results(tmp_path, noisy_rig()) == dict.fromkeys(PARTS, True)


def test_an_open_interlock_fails_and_so_does_all_that_needs_a_laser(tmp_path: Path) -> None:
    found = results(tmp_path, noisy_rig(controller={"interlock_closed": False}))
    assert [part for part, ok in found.items() if ok] == ["controller", "camera"]


def test_a_picture_of_another_size_is_the_cameras_fault(tmp_path: Path) -> None:
    rig = noisy_rig()
    other = rig.model_copy(update={"camera": rig.camera.model_copy(update={"height_px": 110})})
    with plain_bench(rig, tmp_path) as bench:
        checks = examine(other, bench, Scripted())
        found = {one.part: one for one in (next(checks) for _ in range(3))}
    assert {part: one.ok for part, one in found.items()} == {
        "controller": True,
        "interlock": True,
        "camera": False,
    }
    assert {"640", "120", "110"} <= {word.strip(";,") for word in found["camera"].found.split()}


def test_a_picture_of_one_number_is_the_cameras_fault(tmp_path: Path) -> None:
    found = results(tmp_path, two_laser_rig())
    assert [part for part, ok in found.items() if not ok] == ["camera"]


def test_a_driver_that_discards_too_few_frames_fails_and_is_put_right_for_the_rest(tmp_path: Path) -> None:
    rig = noisy_rig(camera={"latency_frames": 3})
    found = results(tmp_path, rig, discard_frames=0)
    assert [part for part, ok in found.items() if not ok] == ["latency"]


@pytest.mark.parametrize("signs", [(0.23, None), (None, 0.23)])
def test_a_camera_that_adjusts_itself_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, signs: tuple[float | None, float | None]
) -> None:
    monkeypatch.setattr(
        "workbench.procedure.doctor.find_automatic_control", lambda *_: AutomaticControl(*signs)
    )
    with plain_bench(noisy_rig(), tmp_path) as bench:
        found = {one.part: one for one in examine(noisy_rig(), bench, Scripted())}
    assert (found["automatic control"].kind, found["automatic control"].ok) == ("noted", True)
    assert "23 %" in found["automatic control"].found


def test_a_laser_that_is_not_seen_is_named(tmp_path: Path) -> None:
    beside = {"lasers": {"L2": {"tx": 3.0}}}
    found = results(tmp_path, noisy_rig(truth=beside))
    assert not found["laser L2"]
    assert found["laser L1"]


def test_a_fixed_exposure_that_is_too_short_leaves_spots_too_dim(tmp_path: Path) -> None:
    found = results(tmp_path, noisy_rig(camera={"exposure_s": 3e-6}))
    assert "exposure" not in found, "there is nothing to set"
    assert not found["laser L1"]


def real(rig: Rig, **devices: dict[str, object]) -> Rig:
    """The rig on separate devices, those of the blocks."""
    data = rig.model_dump(exclude_unset=True, exclude={"emulator"})
    return Rig.model_validate(data | {"driver": "opencv+serial", "devices": devices})


def stream(rig: Rig) -> Stream:
    shape = (rig.camera.height_px, rig.camera.width_px)
    return Stream(lambda: np.tile(np.arange(shape[1], dtype=np.uint8), (shape[0], 1)))


MISSING: dict[str, dict[str, object]] = {
    "camera": {"source": "/dev/no-camera"},
    "lasers": {"port": "/dev/no-port"},
}


def test_a_missing_device_does_not_end_the_check(tmp_path: Path) -> None:
    rig = real(two_laser_rig(), **MISSING)
    found = list(examine_rig(rig, tmp_path / "s", lambda _: Scripted()))
    assert [one.part for one in found if not one.ok] == ["controller", "camera"]
    assert [one.part for one in found if one.kind == "not checked"] == ["interlock", *LATER]
    for part, device in (("controller", "/dev/no-port"), ("camera", "/dev/no-camera")):
        assert device in next(one.found for one in found if one.part == part)


def test_the_camera_is_checked_although_the_port_is_missing(tmp_path: Path) -> None:
    served = stream(two_laser_rig())
    rig = real(two_laser_rig(), camera={"source": served.url}, lasers=MISSING["lasers"])
    found = {one.part: one for one in examine_rig(rig, tmp_path / "s", lambda _: Scripted())}
    served.close()
    assert (found["controller"].ok, found["camera"].ok) == (False, True)
    assert found["camera"].kind == "checked"
    assert [part for part, one in found.items() if one.kind == "not checked"] == ["interlock", *LATER]


@pytest.mark.parametrize(("virtual", "stated"), [(False, None), (False, "3B"), (True, None)])
def test_a_laser_class_that_is_not_stated_is_asked_for_on_a_real_bench(
    tmp_path: Path, virtual: bool, stated: str | None
) -> None:
    rig = noisy_rig().model_copy(update={"laser_class": stated})
    operator = Scripted({"laser_class": [Answer(value="2")]})
    with plain_bench(rig, tmp_path) as bench:
        found = {one.part: one for one in examine(rig, replace(bench, virtual=virtual), operator)}
    asked = not virtual and stated is None
    assert ("laser class" in found) == asked
    safety = next(prompt for prompt in operator.asked if prompt.key == "safety")
    if asked:
        assert found["laser class"].kind == "noted"
        assert '"2"' in found["laser class"].found
        assert " 2 " in safety.do, "the answer counts from here on"


@pytest.mark.parametrize("key", ["safety", "doctor"])
def test_no_laser_is_lit_where_the_operator_stops(tmp_path: Path, key: str) -> None:
    operator = Scripted({key: [Answer(action="abort", reason="no eyewear")]})
    lit: list[str] = []
    with plain_bench(noisy_rig(), tmp_path) as bench:
        bench = replace(bench, mark=lit.append)
        assert isinstance(bench.camera, StreamingCamera)
        with pytest.raises(StoppedError, match="no eyewear") as caught:
            list(examine(noisy_rig(), bench, operator))
    assert caught.value.exit_code == 5
    assert lit == ["doctor/camera"]
