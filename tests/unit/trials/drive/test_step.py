"""Step `drive`: world files that are included, drives that end in time, mistakes with their lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.driven_steps import drive_step
from tests.support.rigs import thesis_rig
from workbench.model.errors import BadInputError
from workbench.model.target import WorldTarget
from workbench.model.yamlfile import parse_yaml_model, standalone_text
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.procedure_file import Procedure, load_procedure
from workbench.trials.drive.step import DriveStep

PROCEDURES = Path(__file__).parents[4] / "procedures"
WORLD = """\
format: 1
world: room
title: A room
bodies:
  - {kind: box, name: cube, at_mm: [1100, 0], size_mm: [200, 200, 200]}
"""
PROCEDURE = """\
format: 1
procedure: p
title: T
steps:
  - step: drive
    world: sub/room.yaml
    drives:
      - {name: ahead, start: {x_mm: 0, y_mm: 0}, distance_mm: 2000}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/room.yaml").write_text(WORLD)
    (tmp_path / "p.yaml").write_text(PROCEDURE)
    return tmp_path / "p.yaml"


def test_the_world_file_is_included_relative_to_the_procedure(path: Path) -> None:
    procedure = load_procedure(path)
    (step,) = procedure.steps
    assert isinstance(step, DriveStep)
    assert step.world.title == "A room"
    # The session keeps the text with the world written out, and needs the file no longer.
    text = standalone_text(path, Procedure)
    assert "room.yaml" not in text
    assert parse_yaml_model(text, Path("elsewhere/session.yaml"), Procedure) == procedure


def test_a_missing_world_file_is_named_with_the_line(path: Path) -> None:
    (path.parent / "sub/room.yaml").unlink()
    with pytest.raises(BadInputError, match=r"p.yaml:6: world: the world file sub/room.yaml cannot be used"):
        load_procedure(path)


def test_a_mistake_in_the_world_file_is_named_with_both_lines(path: Path) -> None:
    (path.parent / "sub/room.yaml").write_text(WORLD.replace("kind: box", "kind: bux"))
    with pytest.raises(BadInputError) as raised:
        load_procedure(path)
    assert "p.yaml:6: " in str(raised.value)
    assert "room.yaml:5: " in str(raised.value)
    with pytest.raises(BadInputError):
        check_file(path)


def test_a_world_must_be_named(path: Path) -> None:
    path.write_text(PROCEDURE.replace("    world: sub/room.yaml\n", ""))
    assert any(":5: " in text and "world" in text for text in check_file(path).mistakes)


def test_a_drive_ends_where_the_vehicle_can_just_brake() -> None:
    """Braking takes 84 mm; 1000 - 910 mm = 90 mm is the last pose with that much ahead."""
    (way,) = drive_step().ways
    assert way[0].x_mm == 0.0
    assert way[-1].x_mm == pytest.approx(910.0)
    assert drive_step().captures(thesis_rig()) == 92
    assert drive_step().title == "1 drive in the world one, 92 steps"


def test_a_placement_is_the_start_of_a_drive() -> None:
    (placement,) = drive_step().placements("p.1", thesis_rig())
    assert (placement.key, placement.standoff_mm) == ("p.1/d", 1000.0)
    assert not placement.is_measured
    assert isinstance(placement.target, WorldTarget)
    assert placement.target.pose.x_mm == 0.0
    assert placement.target.speed_mm_s == 300.0


def test_a_start_before_an_obstacle_is_refused() -> None:
    drive = {"name": "d", "start": {"x_mm": 950, "y_mm": 0}, "distance_mm": 100}
    with pytest.raises(
        BadInputError, match=r"drive d: expected a start with at least .* 84 mm, ahead; got 50 mm"
    ):
        drive_step(drives=[drive]).placements("p.1", thesis_rig())


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"stop_mm": 80}, "stop_mm: expected more than the braking distance, 84 mm, got 80"),
        ({"world": "room.yaml"}, "expected the content of a world, got the path room.yaml"),
        (
            {"drives": [{"name": "d", "start": {"x_mm": 0, "y_mm": 0}, "distance_mm": 1}] * 2},
            "distinct names",
        ),
    ],
)
def test_impossible_steps_are_refused(keys: dict[str, object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        drive_step(**keys)


@pytest.mark.long_cases
@pytest.mark.parametrize("name", ["world-obstacles", "world-office"])
def test_procedures_of_the_repository_can_be_planned(name: str) -> None:
    procedure = load_procedure(PROCEDURES / f"{name}.yaml")
    for step in procedure.steps:
        placements = step.placements("p.1", thesis_rig())
        assert placements
        assert all(placement.standoff_mm > 84 for placement in placements)
