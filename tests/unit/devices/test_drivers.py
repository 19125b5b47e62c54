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
