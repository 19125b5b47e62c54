"""Captures of single lasers at one placement."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.ideal import CX, F
from tests.support.running import CY_PX, running, two_laser_rig
from workbench.model.event import CaptureTaken
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.step import flat_placement


def test_each_laser_is_captured_alone_in_every_repeat(tmp_path: Path) -> None:
    placement = flat_placement("p.1", 500.0)
    with running(tmp_path) as session:
        context = session.context
        context.confirm_safety()
        context.bench.target.place(placement)
        assert capture_lasers(context, placement, 2) == 4
        taken = [event for event in session.events if isinstance(event, CaptureTaken)]
        assert [event.key for event in taken] == [
            f"p.1/500mm/{one}/{n:02d}" for one in ("L1", "L2") for n in (0, 1)
        ]
        assert [(event.laser_id, event.repeat) for event in taken] == [
            ("L1", 0),
            ("L1", 1),
            ("L2", 0),
            ("L2", 1),
        ]
        for laser_id, x_mm in (("L1", -60.0), ("L2", 60.0)):
            (spot,) = context.findings[f"p.1/500mm/{laser_id}/00"].spots
            assert (spot.u_px, spot.v_px) == pytest.approx((CX + F * x_mm / 500, CY_PX), abs=0.05)


def test_beams_of_one_emitter_share_a_pair_and_a_repetition_takes_new_ones(tmp_path: Path) -> None:
    """The target is moved and captured again: spots of the first attempt must not remain."""
    rig = two_laser_rig()
    together = tuple(laser.model_copy(update={"emitter": "grating"}) for laser in rig.lasers)
    with running(tmp_path, rig.model_copy(update={"lasers": together})) as session:
        context = session.context
        context.confirm_safety()
        for standoff_mm in (500.0, 480.0):
            placement = flat_placement("p.1", 500.0)
            context.bench.target.place(flat_placement("p.1", standoff_mm))
            assert capture_lasers(context, placement, 1) == 2
            for laser_id, x_mm in (("L1", -60.0), ("L2", 60.0)):
                (spot,) = context.findings[f"p.1/500mm/{laser_id}/00"].spots
                assert (spot.u_px, spot.v_px) == pytest.approx((CX + F * x_mm / standoff_mm, CY_PX), abs=0.05)
        taken = [event for event in session.events if isinstance(event, CaptureTaken)]
        assert [event.laser_id for event in taken] == ["L1", "L2", "L1", "L2"]
        assert taken[0].on == taken[1].on != taken[2].on == taken[3].on
