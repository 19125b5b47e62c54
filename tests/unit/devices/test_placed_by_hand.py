from tests.support.rigs import thesis_rig
from workbench.devices.placed_by_hand import ByHandBlock, PlacedByHand
from workbench.model.target import Placement


def test_the_placement_is_as_the_operator_confirmed_it() -> None:
    placement = Placement(key="p/300mm", standoff_mm=300.0, standoff_sd_mm=0.2)
    assert PlacedByHand.open(ByHandBlock(), thesis_rig()).place(placement) == placement
