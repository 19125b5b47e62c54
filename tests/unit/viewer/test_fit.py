"""A fit in the recording: visible at every time, its residuals at the captures that they are of."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest
import rerun as rr

from tests.support.viewer_stream import COLORS, START_NS, logged
from tests.viewer.readback import Contents
from tests.viewer.session import BAD, LASERS, PLACEMENTS, STANDOFFS, a_fit
from workbench.figures.picture import note, picture
from workbench.model.event import CaptureTaken, CrossValidatedPlacement, FitFinished, FrameRef, ResidualRecord
from workbench.model.fit_charts import residual_chart
from workbench.model.fit_tables import cross_validation_table, parameter_table, term_table
from workbench.viewer.captures import CaptureLog
from workbench.viewer.chart import CURSOR_HALF_PX
from workbench.viewer.entities import to_hex
from workbench.viewer.fit import log_fit, log_no_fit_yet, log_series_styles
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.table_text import table_text

TEXT, BLOB, STRIPS, SCALARS = (
    "TextDocument:text",
    "EncodedImage:blob",
    "LineStrips2D:strips",
    "Scalars:scalars",
)
TEXTS = ("/fit/verdict", "/fit/worst", "/fit/checks", "/fit/parameter_table")
PICTURES = ("/fit/picture/u/image", "/fit/picture/v/image")
REPEATS = 3


def captures_at(*visits: tuple[str, float]) -> CaptureLog:
    """Three captures of each laser at each visit of (placement, standoff)."""
    log = CaptureLog()
    numbered = enumerate(product(visits, LASERS, range(REPEATS)), start=1)
    for n, ((placement, standoff_mm), laser, repeat) in numbered:
        capture = CaptureTaken(
            key=f"c{n}",
            purpose="calibration",
            laser_id=laser,
            placement_key=placement,
            standoff_mm=standoff_mm,
            repeat=repeat,
            on=FrameRef(path="x.png", sha256="0" * 64, time_ns=START_NS + n),
        )
        log.add(capture, None, Moment(n, 1, START_NS + n, standoff_mm))
    return log


CAPTURES = captures_at(*((key, standoff) for standoff, key in PLACEMENTS.items()))
EACH = len(LASERS) * REPEATS
"""Captures at each placement."""
LAST = EACH * len(PLACEMENTS)
AFTER = Moment(LAST + 1, 2, START_NS + LAST + 1)
"""Moment of the fit, after all captures."""


def fitted(folder: Path, fit: FitFinished, captures: CaptureLog = CAPTURES) -> Contents:
    """Notes at the session's start, then the fit."""

    def log(stream: Stream) -> None:
        stream.at(Moment(0, 0, START_NS))
        log_no_fit_yet(stream)
        stream.at(AFTER)
        log_fit(stream, fit, captures, AFTER, COLORS)
        stream.log("after", rr.Scalars(1.0))

    return logged(folder, log)


def old(fit: FitFinished) -> FitFinished:
    """The fit as recorded by versions that did not note the placements of residuals."""
    residuals = tuple(one.model_copy(update={"placement": None}) for one in fit.residuals)
    return fit.model_copy(update={"residuals": residuals})


def test_parameters_are_logged_with_variance_and_prior(tmp_path: Path) -> None:
    contents = fitted(tmp_path, a_fit())
    for one in a_fit().parameters:
        entity = f"/fit/parameters/{one.name}"
        for component, value in (
            ("Measurements:values", one.value),
            ("Measurements:variances", one.sd**2),
            ("sd", one.sd),
            ("prior_value", one.prior_value),
            ("prior_sd", one.prior_sd),
            ("data_share", one.data_share),
            ("determined_by", one.determined_by),
        ):
            assert contents.values(entity, component) == [(AFTER.capture, [value])]


@pytest.mark.parametrize("is_old", [False, True])
def test_residuals_are_at_the_first_capture_of_their_laser_and_placement(
    tmp_path: Path, is_old: bool
) -> None:
    contents = fitted(tmp_path, old(a_fit()) if is_old else a_fit())
    for position, laser in enumerate(LASERS):
        numbers = [1 + EACH * visit + REPEATS * position for visit in range(len(STANDOFFS))]
        mine = [one for one in a_fit().residuals if one.laser_id == laser]
        for name in ("u_px", "v_px", "u_sd_px", "v_sd_px"):
            entity, values = f"/fit/residuals/{name}/{laser}", [[getattr(one, name)] for one in mine]
            assert contents.values(entity, SCALARS) == list(zip(numbers, values, strict=True))
            standoffs = map(round, STANDOFFS)
            assert contents.values(entity, SCALARS, "standoff_mm") == list(
                zip(standoffs, values, strict=True)
            )
        in_sd = [[one.u_px / one.u_sd_px] for one in mine if one.u_px is not None and one.u_sd_px]
        entity = f"/fit/residuals_in_sd/u/{laser}"
        assert contents.values(entity, SCALARS) == list(zip(numbers, in_sd, strict=True))
    assert contents.values("/after", SCALARS) == [(AFTER.capture, [1.0])]


TWICE = captures_at(("first", 500.0), ("middle", 900.0), ("second", 500.0))


def residual(placement: str | None, standoff_mm: float, u_px: float) -> ResidualRecord:
    return ResidualRecord(
        laser_id="L1",
        standoff_mm=standoff_mm,
        u_px=u_px,
        v_px=None,
        u_sd_px=0.05,
        v_sd_px=None,
        placement=placement,
    )


def twice(*placements: str | None) -> FitFinished:
    """Fit of two placements at one standoff, logged in another order than captured."""
    standoffs = (500.0, 500.0, 900.0)
    residuals = [residual(p, s, 0.1 * n) for n, (p, s) in enumerate(zip(placements, standoffs, strict=True))]
    return a_fit().model_copy(update={"residuals": tuple(residuals), "left_out": ()})


def test_two_placements_at_one_standoff_have_their_own_residuals(tmp_path: Path) -> None:
    contents = fitted(tmp_path, twice("second", "first", "middle"), TWICE)
    found = contents.values("/fit/residuals/u_px/L1", SCALARS)
    assert found == [(1, [0.1]), (1 + EACH, [0.2]), (1 + 2 * EACH, [0.0])]


def test_in_old_sessions_residuals_at_one_standoff_are_at_its_first_capture(tmp_path: Path) -> None:
    contents = fitted(tmp_path, twice(None, None, None), TWICE)
    found = contents.values("/fit/residuals/u_px/L1", SCALARS)
    assert found == [(1, [0.0]), (1, [0.1]), (1 + EACH, [0.2])]


def test_residuals_without_captures_are_at_the_moment_of_the_fit(tmp_path: Path) -> None:
    contents = fitted(tmp_path, a_fit(), CaptureLog())
    assert [at for at, _ in contents.values("/fit/residuals/u_px/L1", SCALARS)] == [AFTER.capture] * 4


def cursor_columns(contents: Contents, timeline: str, *positions: int) -> list[float | None]:
    """Middle of the frame around the present standoff in the picture of u at places of a timeline."""
    found: list[float | None] = []
    for at in positions:
        strips = contents.shown("/fit/picture/u/cursor", STRIPS, timeline, at)
        us = [point[0] for point in strips[0]] if strips else []
        found.append((min(us) + max(us)) / 2 if us else None)
        assert not us or max(us) - min(us) == pytest.approx(2 * CURSOR_HALF_PX)
    return found


def columns_of(fit: FitFinished) -> dict[float, float]:
    return dict(picture(residual_chart(fit, "u"), {name: to_hex(c) for name, c in COLORS.items()}).x_px)


def test_the_frame_in_the_chart_is_at_the_standoff_of_the_capture_and_gone_after_the_fit(
    tmp_path: Path,
) -> None:
    contents = fitted(tmp_path, a_fit())
    columns = [columns_of(a_fit())[standoff] for standoff in STANDOFFS]
    first = [1 + EACH * visit for visit in range(len(STANDOFFS))]
    assert cursor_columns(contents, "capture", *first) == pytest.approx(columns)
    assert cursor_columns(contents, "capture", *(n + EACH - 1 for n in first)) == pytest.approx(columns)
    assert cursor_columns(contents, "capture", 0, AFTER.capture, AFTER.capture + 50) == [None] * 3
    assert cursor_columns(contents, "standoff_mm", *map(round, STANDOFFS)) == pytest.approx(columns)
    assert cursor_columns(contents, "step", 1) == pytest.approx(columns[-1:]), "the step's last placement"


def test_a_standoff_visited_twice_has_its_frame_twice(tmp_path: Path) -> None:
    fit = twice("second", "first", "middle")
    columns = columns_of(fit)
    found = cursor_columns(fitted(tmp_path, fit, TWICE), "capture", 1, 1 + EACH, 1 + 2 * EACH)
    assert found == pytest.approx([columns[500.0], columns[900.0], columns[500.0]])


def test_before_a_fit_every_view_has_a_note(tmp_path: Path) -> None:
    contents = logged(tmp_path, log_no_fit_yet)
    assert len({tuple(contents.static(entity, TEXT)[-1]) for entity in TEXTS}) == 1
    assert [contents.static(entity, BLOB) for entity in PICTURES] == [[note("no fit yet")]] * 2


@pytest.mark.parametrize("timeline", ["capture", "step", "standoff_mm"])
def test_a_fit_is_visible_wherever_the_cursor_is(tmp_path: Path, timeline: str) -> None:
    fit = a_fit()
    contents = fitted(tmp_path, fit)
    for at in (0, 1, 17, 10_000):
        for entity, part in zip(
            TEXTS,
            (
                "Calibration accepted",
                "captures",
                table_text(cross_validation_table(fit.left_out)),
                table_text(parameter_table(fit.parameters)),
            ),
            strict=True,
        ):
            assert part in contents.shown(entity, TEXT, timeline, at)[0]
        for entity in PICTURES:
            shown = contents.shown(entity, BLOB, timeline, at)
            assert shown != note("no fit yet")
            assert cv2.imdecode(np.frombuffer(shown, np.uint8), cv2.IMREAD_COLOR) is not None


def test_only_residuals_parameters_and_frames_are_on_a_timeline(tmp_path: Path) -> None:
    """Everything else is static, and cannot disappear while scrubbing."""
    contents = fitted(tmp_path, a_fit())
    moving = {
        entity
        for entity, rows in contents.everything().items()
        if entity.startswith("/fit/") and any("('capture', " in row for row in rows)
    }
    allowed = ("/fit/residuals/", "/fit/residuals_in_sd/", "/fit/parameters/")
    assert {entity for entity in moving if not entity.startswith(allowed)} == {
        "/fit/picture/u/cursor",
        "/fit/picture/v/cursor",
    }


def test_an_axis_that_was_not_measured_has_a_note_and_no_residuals(tmp_path: Path) -> None:
    residuals = tuple(r.model_copy(update={"v_px": None, "v_sd_px": None}) for r in a_fit().residuals)
    contents = fitted(tmp_path, a_fit().model_copy(update={"residuals": residuals}))
    assert contents.static("/fit/picture/v/image", BLOB)[-1] == note("v was not measured")
    assert "/fit/picture/v/cursor" not in contents.entities
    assert not any(e.startswith(("/fit/residuals/v_", "/fit/residuals_in_sd/v")) for e in contents.entities)


@pytest.mark.parametrize("kept", [True, False])
def test_tables_with_rows_are_in_the_documents_and_empty_ones_are_not(tmp_path: Path, kept: bool) -> None:
    fit = a_fit()
    contents = fitted(tmp_path, fit if kept else fit.model_copy(update={"terms": ()}))
    (checks,) = contents.static("/fit/checks", TEXT)[-1]
    assert table_text(cross_validation_table(fit.left_out)) in checks
    assert (table_text(term_table(fit.terms)) in checks) == kept


def test_the_worst_placements_are_listed_first_with_their_captures(tmp_path: Path) -> None:
    left_out = tuple(
        CrossValidatedPlacement(
            placement=key,
            standoff_mm=standoff,
            error_mm=error,
            sd_mm=1.0,
            lasers=(),
            alarm=standoff == BAD[1],
        )
        for (standoff, key), error in zip(PLACEMENTS.items(), (0.5, -2.0, 9.0, 1.0), strict=True)
    )
    contents = fitted(tmp_path, a_fit().model_copy(update={"left_out": left_out}))
    (text,) = contents.static("/fit/worst", TEXT)[-1]
    rows = [line.split() for line in text.partition("─\n")[2].splitlines()]
    assert [row[0] for row in rows] == ["1250", "500", "3000", "200"]
    assert [row[-1] for row in rows] == ["25-36", "13-24", "37-48", "1-12"]
    assert ["!" in row for row in rows] == [True, False, False, False]


def test_residuals_have_the_lasers_names_and_colours(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_series_styles(stream, COLORS))
    for axis, laser in product("uv", LASERS):
        assert contents.static(f"/fit/residuals_in_sd/{axis}/{laser}", "SeriesPoints:names") == [[laser]]
