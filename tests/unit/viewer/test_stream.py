"""Timelines of a recording and what is written into its file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import rerun as rr

from tests.support.viewer_stream import START_NS, logged
from tests.viewer.readback import front_tab, layout_views
from tests.viewer.session import a_rig
from workbench.viewer.blueprint import TrialTab, blueprint
from workbench.viewer.rrd import open_rrd
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.window import free_port

SCALARS = "Scalars:scalars"


def test_a_moment_stands_on_every_timeline_and_the_standoff_is_whole_millimetres(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        stream.at(Moment(3, 2, START_NS + 7, 199.6))
        stream.log("a/b", rr.Scalars(1.5))

    contents = logged(tmp_path, log)
    assert contents.values("/a/b", SCALARS) == [(3, [1.5])]
    assert contents.values("/a/b", SCALARS, "step") == [(2, [1.5])]
    assert contents.values("/a/b", SCALARS, "standoff_mm") == [(200, [1.5])]
    ((time, _),) = contents.values("/a/b", SCALARS, "time")
    assert time.value == START_NS + 7


def test_what_belongs_to_no_standoff_does_not_keep_the_last_one(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        stream.at(Moment(1, 1, START_NS, 500.0))
        stream.at(Moment(2, 1, START_NS + 1))
        stream.log("a", rr.Scalars(1.0))

    (row,) = logged(tmp_path, log).everything()["/a"]
    assert "standoff_mm" not in row
    assert "('capture', 2)" in row


def test_nothing_but_the_stated_timelines_is_on_a_row(tmp_path: Path) -> None:
    """A log time or tick would make a rebuilt recording differ from the first."""
    contents = logged(tmp_path, lambda stream: stream.log("a", rr.Scalars(1.0)))
    (row,) = contents.everything()["/a"]
    names = re.findall(r"\('([^']+)', ", row)
    assert names == [SCALARS, "capture", "standoff_mm", "step", "time"]


def test_static_data_are_on_no_timeline(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: stream.log("a", rr.Scalars(1.0), static=True))
    assert contents.everything()["/a"] == ["[('Scalars:scalars', [1.0])]"]


def test_the_recording_is_named_after_the_session_and_has_its_properties(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: stream.describe("session", id="x", captures=3))
    (recording,) = open_rrd(tmp_path / "part.rrd").recordings()
    assert (recording.application_id, recording.recording_id) == ("workbench", "part")
    assert contents.everything()["/__properties/session"] == ["[('captures', [3]), ('id', ['x'])]"]


def test_a_static_text_is_shown_at_every_time_and_the_last_one_wins(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        stream.log_static_text("a", "first")
        stream.log_static_text("a", "*second*", rr.MediaType.MARKDOWN)

    contents = logged(tmp_path, log)
    assert contents.static("/a", "TextDocument:text") == [["first"], ["*second*"]]
    assert contents.static("/a", "TextDocument:media_type") == [["text/plain"], ["text/markdown"]]


def test_the_last_layout_is_the_one_that_the_file_opens_with(tmp_path: Path) -> None:
    trial = TrialTab("t", (("errors", "Errors so far"),))
    logged(tmp_path, lambda stream: stream.lay_out(blueprint(a_rig(), [trial], "trial")))
    assert front_tab(tmp_path / "part.rrd") == "t"
    assert "Errors so far" in {view.name for view in layout_views(tmp_path / "part.rrd")}


def check_often(stream: Stream) -> None:
    for _ in range(3):
        stream.check_written()


def test_a_served_recording_that_does_not_grow_has_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "part.rrd"
    stream = Stream(path, "part", blueprint(a_rig()), free_port())
    monkeypatch.setattr("workbench.viewer.stream.STALL_S", 0.0)
    stream.flush()
    for _ in range(5):  # grows
        with path.open("ab") as file:
            file.write(b"x")
        stream.check_written()
    stream.check_written()
    with pytest.raises(OSError, match=r"part\.rrd"):
        check_often(stream)
    stream.close()


def test_a_file_that_cannot_be_written_is_named() -> None:
    with pytest.raises(OSError, match="/dev/full"):
        Stream(Path("/dev/full"), "part", blueprint(a_rig()))


def test_a_closed_recording_leaves_no_busy_threads(tmp_path: Path) -> None:
    """Rerun keeps two threads of each layout, which wake five times a second, and two of a recording."""

    def threads(number: int) -> int:
        for n in range(number):
            stream = Stream(tmp_path / f"{number}-{n}.rrd", f"{number}-{n}", layout)
            stream.log("a", rr.Scalars(1.0))
            stream.close()
        return len(list(Path("/proc/self/task").iterdir()))

    layout = blueprint(a_rig())
    before = threads(1)
    assert threads(12) <= before + 2 * 13
