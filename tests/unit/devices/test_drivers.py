"""Drivers by entry point: which are installed, and what becomes of one that is not, or cannot be imported."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.driver_package import put_on_path, write_driver
from workbench.devices.controller_line import ControllerLine
from workbench.devices.drivers import DriverUnusableError, installed, load_driver
from workbench.model.device_block import DeviceBlock

OWN = {
    "workbench.cameras": ["opencv"],
    "workbench.lasers": ["nidaqmx", "serial"],
    "workbench.targets": ["by_hand"],
}


@pytest.mark.parametrize(("group", "names"), OWN.items())
def test_own_drivers_are_installed_and_have_a_block(group: str, names: list[str]) -> None:
    assert set(names) <= set(installed(group))
    for name in names:
        assert issubclass(load_driver(group, name).settings_type, DeviceBlock)


def test_a_driver_is_what_its_entry_point_names() -> None:
    assert load_driver("workbench.lasers", "serial") is ControllerLine


def test_an_unknown_driver_names_the_installed_ones() -> None:
    with pytest.raises(DriverUnusableError) as caught:
        load_driver("workbench.lasers", "laserbeam9000")
    assert all(name in str(caught.value) for name in ("laserbeam9000", "nidaqmx", "serial"))


def test_a_group_without_drivers() -> None:
    assert installed("workbench.teleporters") == []
    with pytest.raises(DriverUnusableError):
        load_driver("workbench.teleporters", "any")


@pytest.mark.parametrize("what", ["lab_half:NoSuchClass", "no_such_module:Line", "lab_half:Line.no.such"])
def test_a_driver_that_cannot_be_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    write_driver(tmp_path, "lab_half", "class Line: pass\n", {"workbench.lasers": {"half": what}})
    put_on_path(tmp_path, monkeypatch)
    assert "half" in installed("workbench.lasers")
    with pytest.raises(DriverUnusableError):
        load_driver("workbench.lasers", "half")


@pytest.mark.parametrize(
    ("number", "import_fails", "kind"),
    [
        (1, "import ctypes; ctypes.CDLL('libno_such_vendor.so')", "OSError"),
        (2, "raise RuntimeError('no licence')", "RuntimeError"),
        (3, "raise SystemExit(0)", "SystemExit"),
        (4, "class Line(:", "SyntaxError"),
    ],
)
def test_a_driver_whose_import_fails_is_reported_with_the_kind_of_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, import_fails: str, kind: str
) -> None:
    module = f"lab_unloadable_{number}"
    write_driver(tmp_path, module, import_fails, {"workbench.lasers": {"half": f"{module}:Line"}})
    put_on_path(tmp_path, monkeypatch)
    with pytest.raises(DriverUnusableError, match=rf"{module}:Line.*{kind}"):
        load_driver("workbench.lasers", "half")


PARTIAL = """
from workbench.devices.controller_line import ControllerLine
from workbench.devices.opencv_camera import OpenCvCamera
from workbench.devices.placed_by_hand import PlacedByHand

def without(driver, *names):
    members = {n: m for n, m in vars(driver).items() if n not in (*names, "__dict__", "__weakref__")}
    return type(driver.__name__, (), members)

def function(): ...
LineWithoutBlock = without(ControllerLine, "settings_type")
LineWithoutLeases = without(ControllerLine, "has_leases")
LineWithoutOff = without(ControllerLine, "all_off", "state")
LineWithOddBlock = type("Odd", (ControllerLine,), {"settings_type": dict})
CameraWithoutBlock = without(OpenCvCamera, "settings_type")
CameraWithoutOpen = without(OpenCvCamera, "open")
TargetWithoutOpen = without(PlacedByHand, "open")
"""


@pytest.mark.parametrize(
    ("group", "what", "named"),
    [
        ("workbench.lasers", "function", "GuardedLine"),
        ("workbench.lasers", "LineWithoutBlock", "settings_type"),
        ("workbench.lasers", "LineWithoutLeases", "has_leases"),
        ("workbench.lasers", "LineWithoutOff", "all_off, state"),
        ("workbench.lasers", "LineWithOddBlock", "settings_type"),
        ("workbench.cameras", "CameraWithoutBlock", "settings_type"),
        ("workbench.cameras", "CameraWithoutOpen", "open"),
        ("workbench.targets", "TargetWithoutOpen", "open"),
        ("workbench.benches", "PlacedByHand", "BenchDriver"),
    ],
)
def test_a_class_that_lacks_members_is_no_driver(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, group: str, what: str, named: str
) -> None:
    write_driver(tmp_path, "lab_partial", PARTIAL, {group: {"partial": f"lab_partial:{what}"}})
    put_on_path(tmp_path, monkeypatch)
    with pytest.raises(DriverUnusableError, match=named):
        load_driver(group, "partial")


def test_a_name_that_two_distributions_have_is_refused_with_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_driver(tmp_path, "lab_twin", "", {"workbench.lasers": {"serial": "lab_twin:Line"}})
    put_on_path(tmp_path, monkeypatch)
    assert installed("workbench.lasers").count("serial") == 1
    with pytest.raises(DriverUnusableError) as caught:
        load_driver("workbench.lasers", "serial")
    assert all(name in str(caught.value) for name in ("lab_twin", "laser-range-workbench"))
