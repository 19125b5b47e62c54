"""Laser spots of a pair of frames, with their covariance."""

from workbench.model.arrays import Image
from workbench.model.spot import Failure, Spot
from workbench.spots.explain import explain
from workbench.spots.finder import SpotFinder, find_spots, is_compiled
from workbench.spots.persistence import is_same_spot, persistent_spots
from workbench.spots.stuck_beam import position_text, refuse_stuck_beam
from workbench.spots.types import Finding, Scanline

__all__ = [
    "Failure",
    "Finding",
    "Image",
    "Scanline",
    "Spot",
    "SpotFinder",
    "explain",
    "find_spots",
    "is_compiled",
    "is_same_spot",
    "persistent_spots",
    "position_text",
    "refuse_stuck_beam",
]
