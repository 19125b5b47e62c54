"""Calibration files: the published JSON Schema is current, and what contradicts itself is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import ValidationError

from tests.support.rangers import thesis_ranger
from workbench.model.calibration import TERM_VERDICTS, Calibration, FitSummary, Matrix, TermVerdict

SCHEMA = Path(__file__).parents[3] / "docs/calibration.schema.json"


def test_the_schema_is_current() -> None:
    assert SCHEMA.read_text() == json.dumps(Calibration.model_json_schema(), indent=2) + "\n", (
        "run `make schema`"
    )


def changed(path: str, value: Any) -> dict[str, Any]:
    """A sound calibration as data, with one value replaced; numbers in `path` are indices."""
    data = json.loads(thesis_ranger().calibration.model_dump_json())
    *way, last = [int(part) if part.isdigit() else part for part in path.split("/")]
    node: Any = data
    for part in way:
        node = node[part]
    node[last] = value
    return dict(data)


@pytest.mark.parametrize(
    ("path", "value", "where"),
    [
        ("laser_ranger/lasers/0/origin_mm/2", 1.0, ("laser_ranger", "lasers", 0)),
        ("laser_ranger/lasers/0/direction/2", 2.0, ("laser_ranger", "lasers", 0)),
        ("laser_ranger/lasers/0/direction", [0.0, 1.0], ("laser_ranger", "lasers", 0, "direction")),
        ("laser_ranger/lasers", [], ("laser_ranger", "lasers")),
        ("laser_ranger/parameters/covariance/data/1", 1e6, ("laser_ranger", "parameters")),
        ("laser_ranger/parameters/covariance/data/0", -1.0, ("laser_ranger", "parameters")),
        ("laser_ranger/parameters/covariance/rows", 1, ("laser_ranger", "parameters", "covariance")),
        ("laser_ranger/parameters/sd", [1.0], ("laser_ranger", "parameters")),
        ("laser_ranger/parameters/data_share/0", 1.1, ("laser_ranger", "parameters", "data_share", 0)),
        ("laser_ranger/validity/standoff_mm", [900.0, 500.0], ("laser_ranger", "validity")),
        ("laser_ranger/validity/standoff_mm", [0.0, 500.0], ("laser_ranger", "validity")),
        ("laser_ranger/noise/spot_sd_px", 0.0, ("laser_ranger", "noise", "spot_sd_px")),
        ("laser_ranger/fit/noise_scale", 0.9, ("laser_ranger", "fit", "noise_scale")),
        ("laser_ranger/format", 2, ("laser_ranger", "format")),
        ("distortion_model", "rational", ("distortion_model",)),
        # Two copies of one number that differ, and a matrix that does not fit.
        ("laser_ranger/lasers/0/origin_mm/0", -59.0, ()),
        ("laser_ranger/reference_plane/offset_mm", 99.0, ()),
        ("camera_matrix/data/0", 500.0, ()),
        ("camera_matrix/data/2", 0.0, ()),
        ("projection_matrix/data/3", 1.0, ()),
        ("distortion_model", "equidistant", ()),
        ("laser_ranger/parameters/names/0", "focal", ()),
    ],
)
def test_a_file_that_contradicts_itself_is_refused_at_its_key(
    path: str, value: Any, where: tuple[str | int, ...]
) -> None:
    with pytest.raises(ValidationError) as caught:
        Calibration.model_validate(changed(path, value))
    assert caught.value.errors()[0]["loc"] == where


def test_copies_of_a_number_agree_to_nine_digits() -> None:
    f_px = thesis_ranger().calibration.camera_matrix.data[0]
    for relative, agrees in ((1e-10, True), (1e-8, False)):
        data = changed("laser_ranger/parameters/values/0", f_px * (1 + relative))
        assert data["laser_ranger"]["parameters"]["names"][0] == "f_px"
        if agrees:
            assert Calibration.model_validate(data).geometry()["f_px"] == f_px
        else:
            with pytest.raises(ValidationError):
                Calibration.model_validate(data)


def test_geometry_is_all_that_a_range_depends_on() -> None:
    calibration = thesis_ranger().calibration
    geometry = calibration.geometry()
    lens = {"f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3", "offset_mm"}
    rays = {f"L{n}.{name}" for n in (1, 2, 3, 4) for name in ("x_mm", "y_mm", "tx", "ty")}
    assert set(geometry) == lens | rays
    parameters = calibration.laser_ranger.parameters
    stated = dict(zip(parameters.names, parameters.values, strict=True))
    assert all(stated[name] == pytest.approx(value) for name, value in geometry.items())


@pytest.mark.parametrize(("numbers", "good"), [(6, True), (5, False), (7, False)])
def test_a_matrix_has_as_many_numbers_as_rows_times_columns(numbers: int, good: bool) -> None:
    data = {"rows": 2, "cols": 3, "data": [1.0] * numbers}
    if good:
        assert len(Matrix.model_validate(data).data) == numbers
    else:
        with pytest.raises(ValidationError):
            Matrix.model_validate(data)


@pytest.mark.parametrize(
    ("verdict", "because", "usable"),
    [("accepted", "", True), ("refused", "", False), ("refused", "trial run", True)],
)
def test_a_fit_is_usable_if_accepted_or_kept_with_a_reason(verdict: str, because: str, usable: bool) -> None:
    fit = FitSummary.model_validate(
        {
            "rms_px": 0.1,
            "observations": 9,
            "rejected": 0,
            "noise_scale": 1.0,
            "verdict": verdict,
            "accepted_because": because,
        }
    )
    assert fit.usable == usable


def test_every_verdict_on_a_term_has_its_words() -> None:
    assert set(TERM_VERDICTS) == set(get_args(TermVerdict))
