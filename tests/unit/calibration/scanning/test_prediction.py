"""Predicted spots of a scanning head, against the virtual bench's own geometry."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.support.rigs import thesis_rig
from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.prediction import HeadLayout, head_table, predict_head_spots
from workbench.emulator.truth import draw_placement_error
from workbench.model.errors import BadInputError
from workbench.model.head_calibration import HEAD
from workbench.model.rig import Rig, load_rig

RIG = load_rig(Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_predicted_spots_are_those_of_the_bench(seed: int) -> None:
    head = SimulatedHead.of(_with_exact_readings(), seed)
    spots = head.spots([250.0, 900.0], [-30.0, -5.0, 10.0], 0.0, np.random.default_rng(seed))
    values = list(head.values)
    for placement in spots.placements:
        error = draw_placement_error(head.rig, head.spec, placement.key)
        values += [error.error_mm, tan(radians(error.yaw_deg)), tan(radians(error.pitch_deg))]
    predicted = predict_head_spots(jnp.array(values), "plumb_bob", spots.data)
    np.testing.assert_allclose(np.asarray(predicted), spots.position_px, atol=1e-8)


def test_the_table_has_the_priors_of_the_rig_file() -> None:
    table = head_table(RIG, ["a", "b"])
    layout = HeadLayout("plumb_bob")
    own = table.parameters[layout.head]
    assert [one.name for one in own] == [f"head.{name}" for name in HEAD]
    assert own[-1].prior.sd == pytest.approx(radians(RIG.scanning_head.eccentricity_sd_deg))
    assert len(table.parameters[layout.errors]) == 6


def test_tilt_of_the_flats_depth_of_the_axis_and_offset_hide_each_other() -> None:
    """A flat that is turned by t, an axis and an offset that are x_a t smaller give the same spots.

    With x / z = m = tan phi + x_a / z, a tilt t moves a spot by -f x_a m t / z, which is
    -f x_a tan phi t / z, as by the depth of the axis, and -f x_a^2 t / z^2, as by the offset.
    """
    head = SimulatedHead.of(RIG, 1)
    spots = head.spots([400.0, 700.0, 1000.0], [-30.0, -15.0, 0.0, 10.0], 0.0, np.random.default_rng(1))
    names = [one.name for one in head_table(RIG, [one.key for one in spots.placements]).parameters]
    values = np.zeros(len(names))
    values[: len(head.values)] = head.values
    by_value = jax.jacfwd(lambda v: predict_head_spots(v, "plumb_bob", spots.data))(jnp.array(values))
    along = np.asarray(by_value)[:, 0]
    axis_mm = values[names.index("S.x_mm")]
    tilted = along[:, names.index("target_slope_x")]
    hidden = tilted - axis_mm * (along[:, names.index("head.axis_z_mm")] + along[:, names.index("offset_mm")])
    assert np.abs(hidden).max() < 0.05 * np.abs(tilted).max()


def test_a_rig_without_head_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected a scanning head, with the key head"):
        head_table(thesis_rig(), [])


def _with_exact_readings() -> Rig:
    head = RIG.scanning_head.model_copy(update={"reading_sd_deg": 0.0})
    return RIG.model_copy(update={"head": head})
