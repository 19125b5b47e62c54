"""The emulator block of a rig file: mistakes in it are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.support.ideal import FISHEYE, ideal_rig
from tests.support.virtual_bench import THESIS
from workbench.emulator import open_bench
from workbench.emulator.spec import emulator_spec
from workbench.model.errors import BadInputError


@pytest.mark.parametrize(
    ("block", "says"),
    [
        (None, "emulator.seed: is missing"),
        ({"seed": 1, "beam": {"power_mw": -1}}, r"emulator.beam.power_mw: expected 1e-06 to .*, got -1"),
        ({"seed": 1, "truth": {"target_yaw_deg": 61}}, r"emulator.truth.target_yaw_deg: expected .*got 61"),
        ({"seed": 1, "drift": {"u_px": 0.1}}, "emulator.drift.u_px: no such key"),
        ({"seed": 1, "lense": {}}, "emulator.lense: no such key"),
        ({"seed": 1, "truth": {"lasers": {"L9": {}}}}, r"emulator.truth: lasers.L9: expected .*L1"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, block: Any, says: str) -> None:
    rig = THESIS.model_copy(update={"emulator": block})
    with pytest.raises(BadInputError, match=says):
        open_bench(rig, tmp_path / "s")


def test_a_pin_of_another_lens_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"emulator\.truth: p1"):
        emulator_spec(ideal_rig(camera=FISHEYE, truth={"p1": 0.001}))
    assert emulator_spec(ideal_rig(camera=FISHEYE, truth={"k4": 0.001})).truth.k4 == 0.001
