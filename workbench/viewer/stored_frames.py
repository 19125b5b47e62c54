"""Frames that the records of a session refer to."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from workbench.model.arrays import Image
from workbench.model.errors import BadInputError
from workbench.model.event import FrameRef
from workbench.session.frames import recent_image
from workbench.viewer.frame import as_png


@dataclass(frozen=True)
class StoredFrames:
    """Frames in the folder of a session."""

    session_dir: Path

    def image(self, ref: FrameRef) -> tuple[bytes, Image]:
        """PNG file and image (height, width) of a frame.

        Raises:
            BadInputError: the frame is missing, or has changed.
        """
        content = self._read(ref)
        image = recent_image(ref.sha256)
        return as_png(content) if image is None else (content, image)

    def pixels(self, ref: FrameRef) -> Image:
        """Image of a frame, without reading its file where it was stored just now; errors as of `image`."""
        image = recent_image(ref.sha256)
        return self.image(ref)[1] if image is None else image

    def _read(self, ref: FrameRef) -> bytes:
        path = self.session_dir / ref.path
        try:
            content = path.read_bytes()
        except OSError as error:
            raise BadInputError(
                f"{path}: the frame of a journal record cannot be read ({error.strerror}); "
                "restore it from a copy of the session folder"
            ) from None
        # The viewer would show a damaged picture, or none, without an error.
        if ref.sha256 and sha256(content).hexdigest() != ref.sha256:
            raise BadInputError(
                f"{path}: the frame has changed since it was captured (expected sha256"
                f" {ref.sha256[:12]}...); restore it from a copy of the session folder"
            )
        return content
