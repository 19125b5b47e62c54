"""Which spots are found, in which order, and what is said of those that are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw, profile
from workbench.model.errors import BadInputError
from workbench.spots import Failure, Scanline, SpotFinder, explain, find_spots, is_compiled
from workbench.spots.threshold_centroid import thesis_centres

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("line", "middle"),
    [
        (Scanline(0, 30, 1, 0, 2), (30.0, 30.0)),
        (Scanline(0, 30, -1, 0, 2), (30.0, 30.0)),
        (Scanline(30, 0, 0, 1, 2), (30.0, 30.0)),
        (Scanline(0, 0, 1, 1, 2), (30.0, 30.0)),
        (Scanline(0, 59, 2, -2, 2), (30.0, 29.0)),
        (Scanline(0, 20, 3, 1, 2), (30.0, 30.0)),
    ],
)
def test_spots_on_a_line_come_in_its_order(line: Scanline, middle: tuple[float, float]) -> None:
    along = np.array([line.du, line.dv]) / np.hypot(line.du, line.dv)
    places = [np.array(middle) + t * along for t in (-16.0, 0.3, 15.0)]
    frame = draw([Drawn(float(u), float(v)) for u, v in places], rng(), (60, 60))
    spots = find_spots(frame, scanlines=[line], expected=3).spots
    np.testing.assert_allclose([(s.u_px, s.v_px) for s in spots], places, atol=0.1)


def test_two_scanlines_at_once() -> None:
    frame = draw([Drawn(15, 30), Drawn(45, 30), Drawn(30, 12)], rng(), (60, 60))
    lines = [Scanline(0, 30, 1, 0, 2), Scanline(30, 0, 0, 1, 2)]
    assert [round(s.u_px) for s in find_spots(frame, scanlines=lines, expected=3).spots] == [15, 30, 45]


def test_a_change_of_ambient_light_is_told_and_compensated() -> None:
    scene = np.where(np.arange(120) % 40 < 20, 300.0, 1500.0) * np.ones((60, 1))
    true = [Drawn(20.3, 30.2), Drawn(62, 30.2), Drawn(101.4, 29.8)]
    on, off = draw(true, rng(1), ambient=1.4 * scene), draw([], rng(2), ambient=scene)
    finding = find_spots(on, off, scanlines=ROW, expected=3)
    assert finding.failures == (Failure.AMBIENT_CHANGED,)
    for spot, t in zip(finding.spots, true, strict=True):
        assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)


def test_steady_light_is_no_change() -> None:
    on, off = draw([Drawn(50, 30)], rng(1), ambient=200.0), draw([], rng(2), ambient=200.0)
    assert find_spots(on, off, scanlines=ROW, expected=1).failures == ()


def test_hot_pixels_and_reflections_are_no_spots() -> None:
    frame = draw([Drawn(40, 30), Drawn(80, 14)], rng()).copy()
    frame[30, 60] = frame[29, 90] = 3000
    finding = find_spots(frame, scanlines=ROW)
    assert [round(s.u_px) for s in finding.spots] == [40]


def test_a_hot_pixel_inside_a_spot_does_not_move_it() -> None:
    frame = draw([Drawn(40.2, 30, 5e4, 2.0, 2.0)], rng()).copy()
    frame[31, 43] += 1500
    (spot,) = find_spots(frame, scanlines=ROW).spots
    assert spot.u_px == pytest.approx(40.2, abs=5 * spot.u_sd_px)


@pytest.mark.parametrize("apart", [2.6, 3.5, 5.0, 8.0])
def test_overlapping_spots_are_separated(apart: float) -> None:
    true = [Drawn(50, 30, 4e4), Drawn(50 + apart, 30.2, 2e4)]
    finding = find_spots(draw(true, rng(3), ambient=5.0), scanlines=ROW, expected=2)
    assert len(finding.spots) == 2
    for spot, t in zip(finding.spots, true, strict=True):
        assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)
    assert (Failure.MERGED in finding.failures) == (apart < 4 * 1.3)


CROWDS = {
    "three side by side": [(13.8, 20.0), (13.9, 24.1), (8.8, 22.7), (21.3, 23.7)],
    "a merged pair and two more": [(13.8, 16.7), (14.4, 24.5), (24.6, 22.9), (27.6, 22.2)],
    "two merged pairs": [(13.4, 20.6), (16.7, 20.6), (23.3, 20.6), (26.6, 20.6)],
}
"""Places of four lasers' spots on a target far away, u and v."""
SPECKLE = 0.2


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("crowd", CROWDS)
def test_a_crowd_of_spots_is_told_apart(crowd: str, seed: int) -> None:
    """In speckle, whose noise hides the neighbours of a spot from a model that lacks them."""
    places, random = sorted(CROWDS[crowd]), rng(seed)
    light = np.sum([profile((40, 40), Drawn(u, v, 5000.0, 0.75, 0.75)) for u, v in places], axis=0)
    grains = random.gamma(SPECKLE**-2, SPECKLE**2, light.shape)
    frame = Sensor(10.0, 6.0, 8).expose(20.0 + light * grains, random)
    spots = find_spots(frame, expected=4).spots
    assert len(spots) == 4
    for spot, (u, v) in zip(spots, places, strict=True):
        assert spot.u_px == pytest.approx(u, abs=5 * spot.u_sd_px)
        assert spot.v_px == pytest.approx(v, abs=5 * spot.v_sd_px)


APART = {
    "two pairs, one above the other": [(36.0, 25.0), (43.0, 25.0), (36.0, 34.0), (43.0, 34.0)],
    "three in a row and one below": [(30.0, 25.0), (37.0, 25.0), (44.0, 25.0), (37.0, 35.0)],
    "two on a diagonal": [(40.0, 30.0), (45.0, 35.0)],
    "a long chain": [(10.0 + 10.0 * n, 30.0) for n in range(8)],
}
"""Clear spots whose windows overlap and whose light does not mix."""


@pytest.mark.parametrize("expected", [True, False])
@pytest.mark.parametrize("places", APART.values(), ids=APART)
def test_spots_in_each_other_s_windows_are_each_found_once(
    places: list[tuple[float, float]], expected: bool
) -> None:
    for seed in range(5):
        random = rng(seed)
        moved = sorted((u + random.uniform(-0.4, 0.4), v + random.uniform(-0.4, 0.4)) for u, v in places)
        true = [Drawn(u, v, 2e4, 0.9, 0.9) for u, v in moved]
        on, off = draw(true, random, (60, 90)), draw([], random, (60, 90))
        spots = find_spots(on, off, expected=len(true) if expected else None, saturation_dn=4095).spots
        assert len(spots) == len(true)
        for spot, t in zip(spots, true, strict=True):
            assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)
            assert spot.v_px == pytest.approx(t.v, abs=5 * spot.v_sd_px)


@pytest.mark.parametrize("share", [0.1, 0.05])
def test_a_clear_spot_on_dark_paper_is_not_dropped_for_its_neighbours(share: float) -> None:
    true = [Drawn(30.2 + 6.5 * n, 30.1, (1.0, share, 1.0, 1.0)[n] * 5e4, 0.85, 0.85) for n in range(4)]
    for seed in range(5):
        random = rng(seed)
        on, off = draw(true, random), draw([], random)
        spots = find_spots(on, off, scanlines=ROW, expected=4, saturation_dn=4095).spots
        assert [round(s.u_px) for s in spots] == [30, 37, 43, 50]


def test_neighbours_on_the_second_of_two_scanlines_are_both_found() -> None:
    true = [Drawn(20, 30), Drawn(30, 12), Drawn(30.2, 19), Drawn(45, 30)]
    lines = [Scanline(0, 30, 1, 0, 2), Scanline(30, 0, 0, 1, 2)]
    for order in (lines, lines[::-1]):
        spots = find_spots(draw(true, rng(), (60, 60)), scanlines=order, expected=4).spots
        assert sorted((round(s.u_px), round(s.v_px)) for s in spots) == [
            (20, 30),
            (30, 12),
            (30, 19),
            (45, 30),
        ]


def test_bars_of_light_do_not_pass_for_the_noise_of_the_frame() -> None:
    """Bright bars in the columns that a sample of every 256th pixel would come from."""
    scene = np.full((480, 640), 20.0)
    for column in range(0, 640, 128):
        scene[:, max(column - 2, 0) : column + 3] = 3000.0
    random = rng(3)
    true = Drawn(190.3, 240.2, 1.2e3, 1.5, 1.5)
    on, off = (
        draw([true], random, ambient=scene, shape=(480, 640)),
        draw([], random, (480, 640), ambient=scene),
    )
    (spot,) = find_spots(on, off, expected=1, saturation_dn=4095).spots
    assert spot.u_px == pytest.approx(true.u, abs=5 * spot.u_sd_px)


def test_an_ellipse_is_not_split() -> None:
    frame = draw([Drawn(50, 30, 4e4, 2.6, 1.3)], rng(4), ambient=5.0)
    assert len(find_spots(frame, scanlines=ROW).spots) == 1


NOISE = draw([], rng(8))
PROVOKED = [
    (Failure.NO_SPOT, NOISE, 1),
    (Failure.TOO_FEW, draw([Drawn(40, 30)], rng(8)), 2),
    (Failure.TOO_MANY, draw([Drawn(30, 30), Drawn(60, 30)], rng(8)), 1),
    (Failure.TOO_DIM, draw([Drawn(60, 30, 190.0)], rng(11)), 1),
    (Failure.SATURATED, draw([Drawn(60, 30, 4e6)], rng(8)), 1),
    (Failure.OFF_SCANLINE, draw([Drawn(60, 12)], rng(8)), 1),
    (Failure.MERGED, draw([Drawn(60, 30, 5e4), Drawn(63, 30, 5e4)], rng(8)), 2),
    (Failure.AT_EDGE, draw([Drawn(1.0, 30)], rng(8)), 1),
]


@pytest.mark.parametrize(("failure", "frame", "expected"), PROVOKED, ids=[p[0].value for p in PROVOKED])
def test_each_failure_is_named(failure: Failure, frame: np.ndarray, expected: int) -> None:
    assert failure in find_spots(frame, scanlines=ROW, expected=expected).failures


def test_every_failure_is_explained_with_cause_and_remedy() -> None:
    for failure in Failure:
        words = explain(failure)
        assert "Cause: " in words
        assert "Do: " in words


def test_a_reflection_on_the_scanline_is_told_as_one_too_many_and_in_words() -> None:
    lasers, reflection = [Drawn(30, 30), Drawn(60, 30)], Drawn(90, 29.5, 8e3, 1.6, 1.6)
    finding = find_spots(draw([*lasers, reflection], rng(8)), scanlines=ROW, expected=2)
    assert finding.failures == (Failure.TOO_MANY,)
    assert len(finding.spots) == 3
    assert "reflection on the scanline" in explain(Failure.TOO_MANY)


def test_a_spot_at_the_edge_is_honest() -> None:
    z = []
    for seed in range(40):
        (spot,) = find_spots(
            draw([Drawn(0.4, 30, 3e4)], rng(seed), ambient=5.0), scanlines=ROW, expected=1
        ).spots
        assert Failure.AT_EDGE in spot.flags
        z.append((spot.u_px - 0.4) / spot.u_sd_px)
    assert np.std(z) == pytest.approx(1.0, abs=0.05 + 4 / np.sqrt(80))


@pytest.mark.parametrize(
    ("on", "off", "words"),
    [
        (np.zeros((4, 4, 3), np.uint8), None, "colour"),
        (np.zeros((4, 4)), None, "float64"),
        ([[1, 2]], None, "list"),
        (np.zeros((0, 4), np.uint8), None, "no pixel"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 5), np.uint8), "size and depth"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 4), np.uint16), "size and depth"),
    ],
)
def test_bad_input_is_refused_in_words(on: np.ndarray, off: np.ndarray | None, words: str) -> None:
    with pytest.raises(BadInputError, match=words):
        find_spots(on, off)


@pytest.mark.parametrize(
    "line", [Scanline(0, 0, 0, 0, 3), Scanline(0, 0, 1, 0, 0), Scanline(0, float("nan"), 1, 0, 3)]
)
def test_bad_scanlines_are_refused(line: Scanline) -> None:
    with pytest.raises(BadInputError, match="scanline"):
        find_spots(NOISE, scanlines=[line])


def test_a_finder_refuses_another_size() -> None:
    with pytest.raises(BadInputError, match="SpotFinder"):
        SpotFinder((10, 10)).find(NOISE)


def test_a_scanline_beside_the_image_holds_no_spot() -> None:
    assert Failure.NO_SPOT in find_spots(NOISE, scanlines=[Scanline(0, 500, 1, 0, 3)]).failures


def test_the_chain_of_the_thesis_finds_the_same_spots_less_exactly() -> None:
    sensor = Sensor(electrons_per_dn=20.0, bits=8)
    true = [Drawn(30.4, 30.2, 3e4), Drawn(80.1, 29.9, 3e4)]
    on, off = draw(true, rng(1), sensor=sensor), draw([], rng(2), sensor=sensor)
    centres = thesis_centres(on, off, scanlines=ROW, expected=2)
    assert sorted(np.round(centres[:, 0])) == [30, 80]


def test_it_is_known_whether_the_loops_are_compiled(tmp_path: Path) -> None:
    """A technician is told what the first capture waits for."""
    assert not is_compiled(tmp_path)
    find_spots(draw([Drawn(60, 30)], rng()))
    assert is_compiled()
