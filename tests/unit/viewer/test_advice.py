"""Progress of a calibration in the recording: uncertainty of ranges and parameters after each placement."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.viewer_stream import logged
from workbench.model.event import StandoffAdvised
from workbench.viewer.advice import AdviceView, narrowing_chart, uncertainty_chart
from workbench.viewer.stream import Stream


def advised(placements: int, sd: float) -> StandoffAdvised:
    return StandoffAdvised(
        placements=placements,
        relative_range_sd=sd,
        limit=0.03,
        next_standoff_mm=400.0,
        then_relative_range_sd=sd / 2,
        ranges_mm=(100.0, 500.0, 2500.0),
        range_sd=(sd / 4, sd / 2, sd),
        parameter_sd={"f_px": sd, "cx_px": 10 * sd},
    )


ADVICE = [advised(2, 0.08), advised(3, 0.04)]


def test_each_placement_has_a_line_in_per_cent_under_the_limit() -> None:
    chart = uncertainty_chart(ADVICE)
    assert [one.name for one in chart.series] == ["2", "3"]
    assert chart.series[0].y == pytest.approx((2.0, 4.0, 8.0))
    assert [limit.y for limit in chart.limits] == [3.0]
    assert chart.series[0].color != chart.series[1].color, "the latest stands out"


def test_parameters_narrow_over_the_placements() -> None:
    chart = narrowing_chart(ADVICE)
    assert {one.name: one.y for one in chart.series} == {"f_px": (0.08, 0.04), "cx_px": (0.8, 0.4)}
    assert {one.x for one in chart.series} == {(2.0, 3.0)}


def test_without_advice_the_charts_are_empty() -> None:
    assert uncertainty_chart([]).is_empty
    assert narrowing_chart([]).is_empty


def test_the_largest_uncertainty_and_its_limit_are_logged_and_the_pictures_are_static(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        view = AdviceView(stream)
        view.start()
        for one in ADVICE:
            view.take(one)

    contents = logged(tmp_path, log)
    assert contents.values("/advice/largest_range_sd", "Scalars:scalars") == [(1, [8.0]), (1, [4.0])]
    assert contents.values("/advice/limit", "Scalars:scalars") == [(1, [3.0])] * 2
    assert contents.static("/advice/limit", "SeriesLines:names") == [["limit"]]
    for picture in ("/progress/uncertainty/image", "/progress/narrowing/image"):
        assert len(contents.static(picture, "EncodedImage:blob")) >= 1
        assert not any("capture" in row for row in contents.everything()[picture])


def test_an_old_session_without_the_lines_has_the_largest_uncertainty_alone(tmp_path: Path) -> None:
    old = ADVICE[0].model_copy(update={"ranges_mm": (), "range_sd": (), "parameter_sd": {}})

    def log(stream: Stream) -> None:
        view = AdviceView(stream)
        view.start()
        view.take(old)

    contents = logged(tmp_path, log)
    assert contents.values("/advice/largest_range_sd", "Scalars:scalars") == [(1, [8.0])]
