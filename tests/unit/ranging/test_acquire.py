"""The control flow of a reading: normal and alternative captures."""

from __future__ import annotations

import pytest

from tests.support.rangers import IDS, positions, spot_at, spots
from workbench.ranging.acquire import NEXT, State, acquire
from workbench.ranging.ranger import Ranger
from workbench.spots import Finding


def test_normal_capture_is_enough_where_every_spot_shows(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    assert acquire(ranger, "s", shoot).status == "done"
    assert fired == [IDS]


def test_no_spot_asks_for_no_more(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(())

    assert acquire(ranger, "s", shoot).status == "no_points"
    assert fired == [IDS]


def test_spots_that_are_told_apart_ask_for_no_more(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(tuple(spots(ranger, dict.fromkeys(("L1", "L3", "L4"), 700.0))))

    reading = acquire(ranger, "s", shoot)
    assert fired == [IDS]
    assert reading.status == "not_enough_points"
    assert [laser.laser_id for laser in reading.lasers] == ["L1", "L3", "L4"]
    assert reading.notes == ("L2: no spot was seen",)


def test_a_spot_that_may_be_two_is_not_ranged_and_both_lasers_fire_alone(ranger: Ranger) -> None:
    """Far away the pointing of two beams puts their spots on one another: their sum is neither's."""
    crossing = moved_onto(ranger, "L1", "L2", 3000.0)
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        seen = [i for i in ids if len(ids) == 1 or i != "L1"]
        return Finding(tuple(spots(crossing, dict.fromkeys(seen, 3000.0))))

    reading = acquire(crossing, "s", shoot)
    assert fired == [IDS, ("L1",), ("L2",)]
    assert reading.status == "done"
    assert [laser.range_mm for laser in reading.lasers] == pytest.approx([3000.0] * 4)
    lit = crossing.read_lit("s", spots(crossing, dict.fromkeys(("L2", "L3", "L4"), 3000.0)))
    assert [laser.laser_id for laser in lit.lasers] == ["L3", "L4"]
    assert any(note.startswith("L1: its spot may be merged with that at u = ") for note in lit.notes)


def moved_onto(ranger: Ranger, laser_id: str, other: str, range_mm: float) -> Ranger:
    """The sensor with one beam turned so that its spot lies on another's at a range, but for a pixel."""
    there, here = positions(ranger, {other: range_mm, laser_id: range_mm})
    values = ranger.calibration.geometry()
    turned = {
        f"{laser_id}.tx": values[f"{laser_id}.tx"] + (there[0] + 1.0 - here[0]) / values["f_px"],
        f"{laser_id}.ty": values[f"{laser_id}.ty"] + (there[1] - here[1]) / values["f_px"],
    }
    parameters = ranger.calibration.laser_ranger.parameters
    moved = tuple(turned.get(n, v) for n, v in zip(parameters.names, parameters.values, strict=True))
    part = ranger.calibration.laser_ranger
    parameters = parameters.model_copy(update={"values": moved})
    return Ranger(
        ranger.calibration.model_copy(
            update={"laser_ranger": part.model_copy(update={"parameters": parameters})}
        )
    )


def test_every_state_leads_to_an_answer() -> None:
    for state in (State.NORMAL, State.ALTERNATIVE):
        followers = {NEXT[s, seen] for s, seen in NEXT if s is state}
        assert State.ANSWER in followers
        assert state not in followers


def test_alternative_capture_fires_each_laser_alone(coplanar: Ranger) -> None:
    ranger = coplanar
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        if len(ids) > 1:
            return Finding(tuple(spots(ranger, dict.fromkeys(ids[:2], 700.0))))
        return Finding(() if ids == ("L2",) else tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    reading = acquire(ranger, "s", shoot)
    assert fired == [IDS, ("L1",), ("L2",), ("L3",), ("L4",)]
    assert reading.status == "not_enough_points"
    assert [laser.laser_id for laser in reading.lasers] == ["L1", "L3", "L4"]
    assert reading.flat_mm == pytest.approx(700.0)


def test_a_spot_that_every_laser_shows_is_that_of_none(coplanar: Ranger) -> None:
    """Beams of one emitter are on together: what remains of a row is the same spot in each capture."""
    (one,) = spots(coplanar, {"L2": 700.0})

    def shoot(ids: tuple[str, ...]) -> Finding:
        return Finding((one, *spots(coplanar, {"L3": 700.0})) if len(ids) > 1 else (one,))

    reading = acquire(coplanar, "s", shoot)
    assert (reading.status, reading.lasers) == ("not_enough_points", ())
    assert reading.notes[-4:] == (
        *(f"{i}: not on alone, its spot is also that of another laser" for i in ("L1", "L2")),
        *(f"{i}: on alone, no spots on its line" for i in ("L3", "L4")),  # on the other side of the camera
    )


@pytest.mark.parametrize(("alone", "words"), [(0, "no spots"), (2, "2 spots")])
def test_alternative_capture_that_tells_nothing_says_what_was_seen(
    coplanar: Ranger, alone: int, words: str
) -> None:
    astray = spot_at(300.0, 60.0)

    def shoot(ids: tuple[str, ...]) -> Finding:
        if len(ids) > 1:
            return Finding((*spots(coplanar, dict.fromkeys(ids[:2], 700.0)), astray))
        return Finding(tuple(spot for r in (700.0, 900.0)[:alone] for spot in spots(coplanar, {ids[0]: r})))

    reading = acquire(coplanar, "s", shoot)
    assert (reading.status, reading.closest_mm) == ("not_enough_points", None)
    assert "1 of 3 spots on no laser's line: other light" in reading.notes
    assert reading.notes[-4:] == tuple(f"{i}: on alone, {words} on its line" for i in IDS)
