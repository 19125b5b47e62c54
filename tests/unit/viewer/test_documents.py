"""Documents about a capture, a fit and a trial: what is listed, and what is left out."""

from __future__ import annotations

from tests.support.viewer_stream import a_reading, a_spot
from tests.viewer.session import a_fit
from workbench.model.event import CaptureTaken, Fault, FrameRef
from workbench.model.prompt import Prompt
from workbench.model.spot import Failure
from workbench.viewer.captures import CaptureLog
from workbench.viewer.documents import MOST_LINES, capture_line, fit_summary, task_text, without_range
from workbench.viewer.stream import Moment

SOUND = CaptureLog().defects()
"""No capture has a defect."""


def items(markdown: str) -> list[str]:
    """Items of the lists."""
    return [line.removeprefix("- ") for line in markdown.splitlines() if line.startswith("- ")]


def a_capture() -> CaptureTaken:
    return CaptureTaken(
        key="c",
        purpose="calibration",
        laser_id="L2",
        placement_key="p",
        standoff_mm=1250.0,
        repeat=3,
        on=FrameRef(path="x.png", sha256="0" * 64, time_ns=0),
        exposure=1850.0,
        exposure_unit="us",
    )


def test_the_verdict_comes_first_and_every_reason_and_warning_is_an_item() -> None:
    fit = a_fit().model_copy(update={"reasons": ("one", "two"), "warnings": ("three",)})
    lines = fit_summary(fit, SOUND).splitlines()
    assert fit.verdict in lines[0]
    assert f"{fit.rms_px:.3f} px" in lines[0]
    assert f"{fit.observations}" in lines[0]
    assert items(fit_summary(fit, SOUND)) == ["one", "two", "three"]


def test_without_reasons_the_verdict_is_all() -> None:
    bare = a_fit().model_copy(update={"reasons": (), "warnings": ()})
    assert len(fit_summary(bare, SOUND).splitlines()) == 1


def test_named_faults_come_before_reasons_and_are_not_repeated() -> None:
    fault = Fault(name="placement_off", message="900 mm is off")
    fit = a_fit().model_copy(update={"faults": (fault,), "reasons": ("rms", fault.message), "warnings": ()})
    assert items(fit_summary(fit, SOUND)) == ["900 mm is off", "rms"]


def test_captures_with_a_defect_are_listed_after_the_causes() -> None:
    log = CaptureLog()
    for n, spots in enumerate(((), (a_spot("L2", 10.0),), (a_spot("L2", 10.0, 20.0, Failure.SATURATED),))):
        capture = a_capture().model_copy(update={"key": f"c{n}"})
        log.add(capture, None, Moment(n + 1, 1, 0))
        log.spots[capture.key] = spots
    fit = a_fit().model_copy(update={"reasons": ("one",), "warnings": ("last",)})
    first, missing, saturated, last = items(fit_summary(fit, log.defects()))
    assert (first, last) == ("one", "last")
    for words, line in ((("L2", "1250 mm", "no spot", "1-1"), missing), (("saturated", "3-3"), saturated)):
        assert all(word in line for word in words)


def test_a_long_list_ends_with_the_number_of_the_others() -> None:
    reasons = tuple(f"reason {n}" for n in range(MOST_LINES + 3))
    fit = a_fit().model_copy(update={"reasons": reasons, "warnings": ()})
    *shown, last = items(fit_summary(fit, SOUND))
    assert shown == list(reasons[:MOST_LINES])
    assert "3" in last


def test_the_line_of_a_capture_has_number_standoff_laser_and_exposure() -> None:
    line, _, step = capture_line(17, a_capture(), "Capture").partition("  \n")
    for part in ("17", "1250 mm", "L2", "repeat 3", "1850 us"):
        assert part in line
    assert step == "Capture"


def test_the_line_of_a_capture_of_all_lasers_names_those_left_off() -> None:
    every = a_capture().model_copy(
        update={"laser_id": "all", "left_off": ("L1", "L3"), "exposure": None, "exposure_unit": None}
    )
    line = capture_line(1, every, "")
    for part in ("all lasers", "L1, L3"):
        assert part in line
    assert "exposure" not in line


def test_readings_without_a_range_are_listed_with_standoff_and_cause() -> None:
    readings = [a_reading(300.0, 301.0), a_reading(4500.0, None, reading=7)]
    _, *rows = without_range(readings).splitlines()
    (row,) = rows
    assert "4500 mm" in row
    assert "7" in row
    assert "no spot was seen" in row


def test_where_all_have_a_range_nothing_is_said() -> None:
    assert without_range([a_reading(300.0, 301.0)]) == ""
    assert without_range([]) == ""


def test_the_task_is_the_step_with_the_open_prompt() -> None:
    assert task_text("**Step 1**", None) == "**Step 1**"
    prompt = Prompt(key="k", do="Place the target.", expect="It is square.", otherwise="Abort.")
    text = task_text("**Step 1**", prompt)
    for part in ("Step 1", prompt.do, prompt.expect, prompt.otherwise):
        assert part in text
    assert "Otherwise" not in task_text("", Prompt(key="k", do="Go on?"))
