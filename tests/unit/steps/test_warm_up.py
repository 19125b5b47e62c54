"""Step `warm_up`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.running import running
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import StoppedError


@pytest.mark.parametrize("frames", ["0", "-1", "1.5", "1000001"])
def test_frames_are_a_whole_number_up_to_a_million(frames: str) -> None:
    assert wrong_keys(f"step: warm_up, frames: {frames}") == ["steps[0].frames"]


def test_its_default_duration_is_that_of_its_frames() -> None:
    short, long = (parse_step(f"step: warm_up, frames: {n}") for n in (10, 1000))
    assert long.default_duration_s == pytest.approx(100 * short.default_duration_s)
    assert "1000" in long.title
    assert (short.needs, short.gives) == (None, None)


def test_it_takes_its_frames_in_the_dark_and_stops_between_two(tmp_path: Path) -> None:
    marked: list[str] = []
    with running(tmp_path) as session:
        context = session.context
        context.bench = replace(context.bench, mark=marked.append)
        parse_step("step: warm_up, frames: 3").run(context, "p.1")
        assert marked == ["p.1"] * 3
        assert context.bench.lasers.state().lit == ()
        assert session.events == []
        session.stop.append("enough")
        with pytest.raises(StoppedError):
            parse_step("step: warm_up, frames: 3").run(context, "p.1")
    assert len(marked) == 3
