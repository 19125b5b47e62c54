"""`camera: {from: FILE}` of a rig file: a camera file of another program, as priors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workbench.model.camera_source import read_intrinsics
from workbench.model.errors import BadInputError
from workbench.model.intrinsics import camera_values, for_image
from workbench.model.yamlfile import Document, line_of

SIZE = ("width_px", "height_px")
"""Keys of `camera` for the size of the image."""
FROM, NAME = "from", "name"
"""Keys of `camera`: the file, relative to the rig file; and the camera in a file of several."""


def include_camera(document: Document) -> bool:
    """Replace `camera.from` in a rig file's document by the values of that file; whether it has this key.

    Values in the rig file take precedence. A parameter may state its `sd` alone.

    Raises:
        BadInputError: the camera file cannot be used.
    """
    camera = document.data.get("camera")
    if not isinstance(camera, dict) or FROM not in camera:
        return False
    where = f"{document.path}:{line_of(document.data, ('camera', FROM))}: camera.{FROM}"
    source, name = camera[FROM], camera.get(NAME)
    if not isinstance(source, str) or not isinstance(name, str | None):
        raise BadInputError(f"{where}: expected the path of a camera file, got {source!r}")
    try:
        found = read_intrinsics(document.path.parent / Path(source), name)
        width, height = (
            camera.get(key, side) for key, side in zip(SIZE, found.size_px or (0, 0), strict=True)
        )
        if isinstance(width, int) and isinstance(height, int) and width * height > 0:
            found = for_image(found, (width, height))
        given = camera_values(found)
    except BadInputError as error:
        raise BadInputError(f"{where}: {error}") from None
    if camera.get("lens", given["lens"]) != given["lens"]:
        raise BadInputError(
            f"{where}: its lens model is {given['lens']}, camera.lens is {camera['lens']}; remove camera.lens"
        )
    for key, value in given.items():
        camera[key] = _merged(value, camera[key]) if key in camera else value
    camera.pop(FROM)
    camera.pop(NAME, None)
    return True


def _merged(given: Any, stated: Any) -> Any:
    """Prior of the rig file, with the value of the camera file where it states its sd alone."""
    return {**given, **stated} if isinstance(given, dict) and isinstance(stated, dict) else stated
