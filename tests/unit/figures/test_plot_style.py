"""Matplotlib's settings while the workbench draws."""

from __future__ import annotations

from threading import Thread

import matplotlib as mpl
import pytest

from workbench.figures.plot_style import own_style


def test_a_user_s_settings_take_no_part_and_come_back() -> None:
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "axes.grid": True}):
        with own_style():
            assert mpl.rcParams["lines.linewidth"] == mpl.rcParamsDefault["lines.linewidth"]
            assert not mpl.rcParams["axes.grid"]
            inside = mpl.rcParams["font.size"]
        assert mpl.rcParams["font.size"] == 30.0
        assert mpl.rcParams["axes.grid"]
    with own_style():
        assert mpl.rcParams["font.size"] == inside != 30.0


def test_settings_come_back_after_an_error_too() -> None:
    with mpl.rc_context({"font.size": 30.0}):
        with pytest.raises(ZeroDivisionError), own_style():
            raise ZeroDivisionError
        assert mpl.rcParams["font.size"] == 30.0


def test_fonts_need_no_file_of_the_machine_s() -> None:
    """SVG text as outlines, PDF text in the fonts that every reader has."""
    with own_style():
        assert mpl.rcParams["svg.fonttype"] == "path"
        assert mpl.rcParams["pdf.use14corefonts"]


def test_two_threads_that_draw_do_not_mix_their_styles() -> None:
    """A recording draws on dark ground beside the writer of figures."""
    seen: list[object] = []

    def draw_dark() -> None:
        with own_style(dark=True):
            seen.append(mpl.rcParams["axes.facecolor"])

    with own_style():
        thread = Thread(target=draw_dark)
        thread.start()
        thread.join(0.2)
        inside = mpl.rcParams["axes.facecolor"]
        assert seen == [], "the other thread waits"
    thread.join()
    assert [inside] == [mpl.rcParamsDefault["axes.facecolor"]] != seen
