"""What a bench does by itself: which cameras can be set, and the order in which it closes."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import cast

import pytest

from workbench.devices.protocols import Bench, Camera, LaserBank, Target, settable
from workbench.model.errors import LaserOffNotConfirmedError


class Exposable:
    exposure_unit = ""

    def __init__(self, limits: tuple[float, float] | None) -> None:
        self.exposure_limits = limits

    def set_exposure(self, exposure: float) -> float:
        return exposure

    def grab(self) -> None: ...

    grab_ambient = close = grab


def test_a_camera_is_settable_within_the_limits_of_the_rig_file() -> None:
    camera = cast(Camera, Exposable((1.0, 100.0)))
    assert settable(camera) == (camera, (1.0, 100.0))
    assert settable(cast(Camera, Exposable(None))) is None
    assert settable(cast(Camera, SimpleNamespace(grab=None))) is None


@pytest.mark.parametrize("error", [None, LaserOffNotConfirmedError("on")])
def test_lasers_close_before_the_camera_and_the_camera_in_any_case(error: Exception | None) -> None:
    closed = []

    def close_lasers() -> None:
        closed.append("lasers")
        if error is not None:
            raise error

    bench = Bench(
        cast(Camera, SimpleNamespace(close=lambda: closed.append("camera"))),
        cast(LaserBank, SimpleNamespace(close=close_lasers)),
        cast(Target, None),
    )
    if error is None:
        with bench:
            pass
    else:
        with pytest.raises(LaserOffNotConfirmedError), bench:
            pass
    assert closed == ["lasers", "camera"]


def test_a_real_bench_has_the_time_of_the_computer_and_may_change_while_it_is_closed() -> None:
    bench = Bench(cast(Camera, None), cast(LaserBank, None), cast(Target, None))
    before_ns = time.time_ns()
    bench.clock.continue_after(0)
    assert before_ns <= bench.clock.now_ns() <= time.time_ns()
    assert not bench.rests
