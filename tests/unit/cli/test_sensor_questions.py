"""Answers about a sensor: what they mean, and what is refused at once."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import pi, tan

import pytest

from tests.support.sensor_answers import GIVEN
from workbench.cli.found_devices import FoundDevice
from workbench.cli.sensor_questions import (
    Beam,
    default_serial,
    nearest_mm,
    parse_baseline_sd,
    parse_baselines,
    parse_laser_class,
    parse_lens,
    parse_name,
    parse_quantity,
    parse_serial,
    parse_size,
    parse_yes,
    sensor_questions,
)


@pytest.mark.parametrize(
    "text", ["1280 x 720", "1280x720", "1280×720", "1280 720", "1280 by 720 px", "1280*720"]
)
def test_an_image_size_is_read_in_any_usual_form(text: str) -> None:
    assert parse_size(text) == (1280, 720)


@pytest.mark.parametrize(
    "text", ["", "1280", "720p", "0 x 720", "8 x 8", "20000 x 720", "720 x 1920", "12.5 x 9"]
)
def test_no_image_size(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_size(text)


@pytest.mark.parametrize(
    ("text", "value"), [("3", 3.0), ("3 um", 3.0), ("3,75 um", 3.75), ("3.75um", 3.75), ("3 µm", 3.0)]
)
def test_a_quantity_is_read_with_and_without_its_unit(text: str, value: float) -> None:
    assert parse_quantity(text, "um", 0.5, 50) == value


@pytest.mark.parametrize(
    "text", ["", "3 mm", "0.1", "51", "-3", "three", "nan", "inf", "1,000", "3 3", "1..2"]
)
def test_no_quantity(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_quantity(text, "um", 0.5, 50)


def test_a_focal_length_is_in_pixels_by_the_pitch() -> None:
    assert parse_lens("4 mm", GIVEN).f_px == pytest.approx(4000 / 3)
    assert parse_lens("1200 px", GIVEN).f_px == 1200


def test_a_field_of_view_is_horizontal_unless_it_is_diagonal() -> None:
    assert parse_lens("60 deg", GIVEN).f_px == pytest.approx(640 / tan(pi / 6))
    assert parse_lens("60 deg diagonal", GIVEN).f_px == pytest.approx((640**2 + 360**2) ** 0.5 / tan(pi / 6))


@pytest.mark.parametrize("text", ["", "4", "0 mm", "-4 mm", "0.4 mm", "400 mm", "170 deg", "2 deg", "4 inch"])
def test_no_lens(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_lens(text, GIVEN)


@pytest.mark.parametrize(
    "text", ["-60 30 60", "-60, 30, 60", "-60mm 30mm +60mm", "-60 mm, 30 mm, 60 mm", "-60; 30; 60"]
)
def test_baselines_are_read_in_the_order_of_the_lines(text: str) -> None:
    assert parse_baselines(text, GIVEN) == [Beam(-60.0, "u"), Beam(30.0, "u"), Beam(60.0, "u")]


def test_a_v_marks_a_laser_above_or_below() -> None:
    assert parse_baselines("60 -40v 40.5v", GIVEN) == [Beam(60.0, "u"), Beam(-40.0, "v"), Beam(40.5, "v")]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0",
        "60 60",
        "60 v",
        "-60,30",
        "-60,30,60",
        "left right",
        "0.5",
        "3000",
        "1500",
        " ".join(map(str, range(10, 40))),
    ],
)
def test_no_baselines(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_baselines(text, GIVEN)


def test_a_spot_enters_the_image_at_the_distance_of_a_pinhole() -> None:
    """u = f b / z is half the width at z = f b / (w / 2), v likewise half the height."""
    f_px = 4000 / 3
    assert nearest_mm(Beam(-60.0, "u"), GIVEN) == pytest.approx(f_px * 60 / 640)
    assert nearest_mm(Beam(40.0, "v"), GIVEN) == pytest.approx(f_px * 40 / 360)


@pytest.mark.parametrize(
    ("text", "sd_mm"), [("calliper", 0.2), ("Ruler", 0.5), ("0.1 mm", 0.1), ("0,05", 0.05)]
)
def test_uncertainty_of_baselines_by_means_or_number(text: str, sd_mm: float) -> None:
    assert parse_baseline_sd(text) == sd_mm


@pytest.mark.parametrize("text", ["", "eye", "0", "100 mm", "0.1 cm"])
def test_no_uncertainty_of_baselines(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_baseline_sd(text)


@pytest.mark.parametrize(("text", "expected"), [("2", "2"), ("3r", "3R"), ("class 1m", "1M"), ("3B", "3B")])
def test_laser_class(text: str, expected: str) -> None:
    assert parse_laser_class(text) == expected


@pytest.mark.parametrize("text", ["", "unknown", "IIIa", "II", "5", "3"])
def test_a_laser_class_is_never_assumed(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_laser_class(text)
    (question,) = (one for one in sensor_questions([], [], []) if one.key == "laser_class")
    assert question.default == ""


@pytest.mark.parametrize("text", ["", "a b", "../x", "-x", "x" * 61, "taken"])
def test_no_name(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_name(text, ["taken"])


@pytest.mark.parametrize(("text", "expected"), [("yes", True), ("No", False)])
def test_yes_or_no(text: str, expected: bool) -> None:
    assert parse_yes(text) is expected
    with pytest.raises(ValueError, match="expected"):
        parse_yes(text[0])


def test_devices_that_were_found_are_named_and_the_first_is_the_default() -> None:
    cameras = [FoundDevice("/dev/video2", "Grey camera"), FoundDevice("/dev/video4", "Other")]
    ports = [FoundDevice("/dev/ttyACM7", "Uno")]
    of = {one.key: one for one in sensor_questions(cameras, ports, [])}
    assert (of["camera"].default, of["port"].default) == ("/dev/video2", "/dev/ttyACM7")
    assert all(one.path in of["camera"].hint and one.name in of["camera"].hint for one in cameras)


@pytest.mark.parametrize("wrong", ["", "unknown", "x" * 61])
def test_a_serial_number_identifies_the_sensor(wrong: str) -> None:
    with pytest.raises(ValueError, match="serial number"):
        parse_serial(wrong)


def test_the_default_serial_number_is_another_one_later(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []
    for when in (0, 1):
        moment = time.gmtime(when)
        monkeypatch.setattr(time, "localtime", lambda moment=moment: moment)
        given.append(parse_serial(default_serial()))
    assert given[0] != given[1]


@pytest.mark.parametrize("key", ["camera", "port"])
def test_a_device_is_one_word(key: str) -> None:
    (question,) = (one for one in sensor_questions([], [], []) if one.key == key)
    check: Callable[..., object] = question.check
    check("/dev/anything", GIVEN)
    for wrong in ("", "two words"):
        with pytest.raises(ValueError, match="expected"):
            check(wrong, GIVEN)


def test_the_answers_of_the_tests_are_valid() -> None:
    for question in sensor_questions([], [], []):
        question.check(GIVEN[question.key], GIVEN)
