"""A device's block of a rig file: its own keys, and no others."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from workbench.model.device_block import DeviceBlock
from workbench.model.rig import AnyDeviceBlock


class Lamp(DeviceBlock):
    """A device with a setting."""

    power_w: float = 5.0


def test_a_block_adds_settings_to_the_driver_s_name() -> None:
    assert Lamp.model_validate({}) == Lamp(driver=None, power_w=5.0)
    assert Lamp.model_validate({"driver": "mine", "power_w": 3}).power_w == 3.0


def test_a_setting_that_the_driver_does_not_have_is_refused_by_its_name() -> None:
    with pytest.raises(ValidationError) as caught:
        Lamp.model_validate({"driver": "mine", "power": 3})
    assert [error["loc"] for error in caught.value.errors()] == [("power",)]


def test_as_it_stands_in_the_file_any_setting_is_kept() -> None:
    block = AnyDeviceBlock.model_validate({"driver": "mine", "power": 3})
    assert block.model_dump() == {"driver": "mine", "power": 3}
