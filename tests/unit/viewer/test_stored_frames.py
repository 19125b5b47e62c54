"""Frames that records refer to: whole, unchanged, decoded once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.model.errors import BadInputError
from workbench.session.frames import FrameStore
from workbench.viewer.stored_frames import StoredFrames

IMAGE = np.arange(48, dtype=np.uint8).reshape(6, 8)


@pytest.mark.parametrize("recent", [True, False])
def test_a_frame_is_its_file_and_its_image(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recent: bool
) -> None:
    ref = FrameStore(tmp_path).save("p/00", "on", IMAGE, 0)
    if not recent:
        monkeypatch.setattr("workbench.viewer.stored_frames.recent_image", lambda _: None)
    content, image = StoredFrames(tmp_path).image(ref)
    assert content == (tmp_path / ref.path).read_bytes()
    np.testing.assert_array_equal(image, IMAGE)
    np.testing.assert_array_equal(StoredFrames(tmp_path).pixels(ref), IMAGE)


def test_a_frame_that_is_missing_or_has_changed_is_named(tmp_path: Path) -> None:
    ref = FrameStore(tmp_path).save("p/00", "on", IMAGE, 0)
    path = tmp_path / ref.path
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(BadInputError, match=r"00-on\.png"):
        StoredFrames(tmp_path).image(ref)
    path.unlink()
    with pytest.raises(BadInputError, match=r"00-on\.png"):
        StoredFrames(tmp_path).image(ref)
