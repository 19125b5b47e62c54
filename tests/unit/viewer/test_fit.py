"""A fit in the recording: parameters, residuals at their standoffs, tables."""

from __future__ import annotations

from pathlib import Path

import pytest
import rerun as rr

from tests.support.viewer_stream import COLORS, HERE, logged
from tests.viewer.session import LASERS, STANDOFFS, a_fit
from workbench.model.fit_tables import cross_validation_table, parameter_table, term_table
from workbench.viewer.fit import log_fit, log_no_fit_yet
from workbench.viewer.stream import Stream
from workbench.viewer.table_text import table_text

TEXT = "TextDocument:text"


def test_parameters_are_logged_with_variance_and_prior(tmp_path: Path) -> None:
    contents = logged(tmp_path, lambda stream: log_fit(stream, a_fit(), HERE, COLORS))
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
            assert contents.values(entity, component) == [(1, [value])]


def test_residuals_stand_at_their_standoffs_and_what_follows_at_the_fit_s_moment(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        log_fit(stream, a_fit(), HERE, COLORS)
        stream.log("after", rr.Scalars(1.0))

    contents = logged(tmp_path, log)
    for laser in LASERS:
        for name in ("u_px", "v_px", "u_sd_px", "v_sd_px"):
            expected = [
                (round(r.standoff_mm), [getattr(r, name)]) for r in a_fit().residuals if r.laser_id == laser
            ]
            entity = f"/fit/residuals/{name}/{laser}"
            assert contents.values(entity, "Scalars:scalars", "standoff_mm") == expected
    assert len(STANDOFFS) == len(contents.values("/fit/residuals/u_px/L1", "Scalars:scalars"))
    assert contents.values("/after", "Scalars:scalars", "standoff_mm") == [(500, [1.0])]


def test_an_axis_that_was_not_measured_has_a_note_and_no_residuals(tmp_path: Path) -> None:
    residuals = tuple(r.model_copy(update={"v_px": None, "v_sd_px": None}) for r in a_fit().residuals)
    fit = a_fit().model_copy(update={"residuals": residuals})
    contents = logged(tmp_path, lambda stream: log_fit(stream, fit, HERE, COLORS))
    assert {"/fit/chart/v/note", "/fit/chart/u/grid"} <= contents.entities
    assert not {"/fit/chart/u/note", "/fit/chart/v/grid"} & contents.entities
    assert not any(entity.startswith("/fit/residuals/v_") for entity in contents.entities)


@pytest.mark.parametrize("kept", [True, False])
def test_tables_with_rows_are_in_the_documents_and_empty_ones_are_not(tmp_path: Path, kept: bool) -> None:
    fit = a_fit()
    shown = fit if kept else fit.model_copy(update={"terms": ()})
    contents = logged(tmp_path, lambda stream: log_fit(stream, shown, HERE, COLORS))
    ((_, (checks,)),) = contents.values("/fit/checks", TEXT)
    assert table_text(cross_validation_table(fit.left_out)) in checks
    assert (table_text(term_table(fit.terms)) in checks) == kept
    ((_, (parameters,)),) = contents.values("/fit/parameter_table", TEXT)
    assert parameters == table_text(parameter_table(fit.parameters))


def test_every_view_of_a_fit_says_so_before_there_is_one(tmp_path: Path) -> None:
    contents = logged(tmp_path, log_no_fit_yet)
    documents = {"/fit/summary", "/fit/checks", "/fit/parameter_table"}
    notes = {"/fit/chart/u/note", "/fit/chart/v/note"}
    assert documents | notes <= contents.entities
    assert len({contents.values(entity, TEXT)[0][1][0] for entity in documents}) == 1
