"""Names of entities and timelines and colours of lasers, common to logging and layout."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.model import chart

APPLICATION = "workbench"

CAPTURE = "capture"
"""Timeline: captures, counted from 1; preparations of a capture have the number of that capture."""
STEP = "step"
"""Timeline: steps, counted from 1 through all procedures of the session."""
WALL_CLOCK = "time"
"""Timeline: wall clock; frames and their spots have the time of exposure."""
STANDOFF = "standoff_mm"
"""Timeline: standoff by the ruler in whole millimetres, for measurements at one standoff."""

BENCH = "bench"
CAMERA = f"{BENCH}/camera"
IMAGE = f"{CAMERA}/image"
SPOTS_IN_IMAGE = f"{CAMERA}/spots"
RINGS_IN_IMAGE = f"{CAMERA}/rings"
RAYS = f"{BENCH}/rays"
TARGET = f"{BENCH}/target"
SPOTS_ON_TARGET = f"{BENCH}/spots"
RANGED_POINTS = f"{BENCH}/ranged"

SPOTS = "spots"
UNASSIGNED = "unassigned"
STANDOFF_SCALAR = "target/standoff_mm"

STEP_LOG = "steps/log"
LANES = "steps/lanes"
LANE_PROCEDURE = f"{LANES}/procedure"
LANE_STEP = f"{LANES}/step"
LANE_LASER = f"{LANES}/laser"

FIT_SUMMARY = "fit/summary"
FIT_TABLE = "fit/parameter_table"
FIT_CHECKS = "fit/checks"
FIT_PARAMETERS = "fit/parameters"
FIT_RESIDUALS = "fit/residuals"
FIT_CHART = "fit/chart"

TRIAL_SUMMARY = "trial/summary"
TRIAL_ERRORS = "trial/errors"
TRIAL_CHART = "trial/chart"
TRIAL_CHARTS = "trial/charts"
"""Parent of the charts of a trial's results except the first."""

Rgb = tuple[int, int, int]

GREY: Rgb = (150, 150, 150)
WHITE: Rgb = (235, 235, 235)
RED: Rgb = (255, 70, 70)


def laser_colors(laser_ids: Sequence[str]) -> dict[str, Rgb]:
    """Colours of lasers for Rerun."""
    return {laser: from_hex(color) for laser, color in chart.laser_colors(laser_ids).items()}


def from_hex(color: str) -> Rgb:
    """Red, green, blue of `#rrggbb`."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def to_hex(color: Rgb) -> str:
    """`#rrggbb` of red, green, blue."""
    return f"#{bytes(color).hex()}"


def trial_charts(names: Sequence[str]) -> list[str]:
    """Entities of the charts of a trial's results, by name; the first chart replaces the live chart."""
    return [TRIAL_CHART, *(under(TRIAL_CHARTS, name) for name in names[1:])][: len(names)]


def under(parent: str, *parts: str) -> str:
    """Entity path of `parts` below `parent`, with special characters escaped."""
    import rerun as rr

    return "/".join([parent, *(rr.escape_entity_path_part(part) for part in parts)])
