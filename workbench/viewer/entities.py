"""Names of entities and timelines and colours of lasers, common to logging and layout."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from workbench.model import chart

APPLICATION = "workbench"

CAPTURE = "capture"
"""Timeline: captures, counted from 1; preparations of a capture have the number of that capture."""
STEP = "step"
"""Timeline: steps, counted from 1 through all procedures; the session's start has the number of the first."""
WALL_CLOCK = "time"
"""Timeline: wall clock; frames and their spots have the time of exposure."""
STANDOFF = "standoff_mm"
"""Timeline: standoff of the present placement by the ruler, in whole millimetres."""

FRAME = "frame"
IMAGE = f"{FRAME}/image"
SCANLINES = f"{FRAME}/scanlines"
PREDICTED_SPOTS = f"{FRAME}/predicted"
PREDICTED_ELLIPSES = f"{FRAME}/predicted_ellipses"
SPOTS_IN_IMAGE = f"{FRAME}/spots"

CROPS = "crops"
CROPS_IMAGE = f"{CROPS}/image"
CROPS_CENTRES = f"{CROPS}/centres"
CROPS_ELLIPSES = f"{CROPS}/ellipses"
CROPS_LABELS = f"{CROPS}/labels"

TASK = "task"
"""Present step, and the open prompt: shown while a session runs."""
NOW = "now"
"""Text about the capture at the time cursor."""

BENCH = "bench"
CAMERA = f"{BENCH}/camera"
RAYS = f"{BENCH}/rays"
TARGET = f"{BENCH}/target"
SPOTS_ON_TARGET = f"{BENCH}/spots"
RANGED_POINTS = f"{BENCH}/ranged"

WORLD = "world"
WORLD_BODIES = f"{WORLD}/bodies"
WORLD_VEHICLE = f"{WORLD}/vehicle"
WORLD_BEAMS = f"{WORLD}/beams"
WORLD_ANSWERS = f"{WORLD}/answers"

SPOTS = "spots"
AMBIENT = "ambient"
"""Median of the dark frame, DN."""
SPOTS_RECORD = f"{SPOTS}/record"
"""All quantities of all spots of a capture."""
CAPTURE_RECORD = "capture/record"
"""Subject of each capture: laser, placement, standoff."""
UNASSIGNED = "unassigned"

STEP_LOG = "steps/log"
LANES = "steps/lanes"
LANE_PROCEDURE = f"{LANES}/procedure"
LANE_STEP = f"{LANES}/step"
LANE_LASER = f"{LANES}/laser"
LANE_EXPOSURE = f"{LANES}/exposure"
LANE_SATURATION = f"{LANES}/saturation"
LANE_DARK = f"{LANES}/dark_frame"

ADVICE = "advice"
RANGE_SD = f"{ADVICE}/largest_range_sd"
RANGE_SD_LIMIT = f"{ADVICE}/limit"
UNCERTAINTY = "progress/uncertainty"
NARROWING = "progress/narrowing"

FIT_VERDICT = "fit/verdict"
FIT_WORST = "fit/worst"
FIT_TABLE = "fit/parameter_table"
FIT_CHECKS = "fit/checks"
FIT_PARAMETERS = "fit/parameters"
FIT_RESIDUALS = "fit/residuals"
FIT_RESIDUALS_IN_SD = "fit/residuals_in_sd"
FIT_PICTURE = "fit/picture"

TRIALS = "trials"

Rgb = tuple[int, int, int]
OPAQUE = 255
MOST_PACKED = 1024
"""Number of packed lists of colours that are kept."""

GREY: Rgb = (150, 150, 150)
WHITE: Rgb = (235, 235, 235)
RED: Rgb = (255, 70, 70)


def laser_colors(laser_ids: Sequence[str]) -> dict[str, Rgb]:
    """Colours of lasers for Rerun."""
    return {laser: from_hex(color) for laser, color in chart.laser_colors(laser_ids).items()}


def packed(colors: Sequence[Rgb]) -> NDArray[np.uint32]:
    """Opaque colours as Rerun keeps them, 0xRRGGBBAA; its own conversion takes 0.1 ms for each mark."""
    return _packed(tuple(colors))


@lru_cache(MOST_PACKED)
def _packed(colors: tuple[Rgb, ...]) -> NDArray[np.uint32]:
    values = [red << 24 | green << 16 | blue << 8 | OPAQUE for red, green, blue in colors]
    return np.array(values, dtype=np.uint32)


def from_hex(color: str) -> Rgb:
    """Red, green, blue of `#rrggbb`."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def to_hex(color: Rgb) -> str:
    """`#rrggbb` of red, green, blue."""
    return f"#{bytes(color).hex()}"


def trial_tables(trial: str) -> str:
    """Entity of the tables of a trial."""
    return under(TRIALS, trial, "tables")


def trial_errors(trial: str) -> str:
    """Parent of the errors of a trial's readings, one entity for the sensor and each laser."""
    return under(TRIALS, trial, "errors")


def trial_picture(trial: str, chart_name: str) -> str:
    """Entity of the picture of one chart of a trial."""
    return under(TRIALS, trial, "pictures", chart_name)


def under(parent: str, *parts: str) -> str:
    """Entity path of `parts` below `parent`, with special characters escaped."""
    import rerun as rr

    return "/".join([parent, *(rr.escape_entity_path_part(part) for part in parts)])
