"""Views that fit far worse than the others are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.free_views import RIG, views
from workbench.calibration.checks.board_views import suspect_notes, view_residuals
from workbench.calibration.selection.camera_fit import fit_camera


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_sound_views_are_not_suspect(seed: int) -> None:
    seen = view_residuals(fit_camera(RIG, views(8, seed)))
    assert [view.name for view in seen] == [f"V{n}" for n in range(1, 9)]
    assert not any(view.is_suspect for view in seen)
    assert suspect_notes(seen) == []


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_view_with_misread_corners_is_suspect(seed: int) -> None:
    sound = views(8, seed)
    position = np.array(sound[3].corners.position_px)
    position[:12] += np.random.default_rng(seed).normal(0.0, 2.0, (12, 2))
    sound[3] = replace(sound[3], corners=replace(sound[3].corners, position_px=position))
    seen = view_residuals(fit_camera(RIG, sound))
    assert [view.name for view in seen if view.is_suspect] == ["V4"]
    (note,) = suspect_notes(seen)
    assert "V4" in note
