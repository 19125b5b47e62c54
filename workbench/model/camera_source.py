"""Readers of camera files: ROS camera_info, OpenCV, Kalibr, mrcal, and the workbench's own."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from workbench.model.contents import not_text, read_file
from workbench.model.errors import BadInputError
from workbench.model.intrinsics import Intrinsics
from workbench.model.lens import COEFFICIENTS, LensName
from workbench.model.yamlfile import LARGEST_BYTES, parse_document

# OpenCV is imported where it is used: other files are read faster without it.
if TYPE_CHECKING:
    import cv2

ROS, OPENCV, KALIBR, MRCAL = "ROS camera_info", "OpenCV file", "Kalibr camchain", "mrcal camera model"
EXPECTED = f"a camera file ({ROS}, {OPENCV} in YAML or XML, {KALIBR} or {MRCAL})"
RATIONAL = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y")
"""OpenCV's distortion coefficients of a perspective lens, in its order."""
NEGLIGIBLE = 1e-9
"""Largest value of a coefficient that counts as 0."""
INSTEAD = (
    "this lens model is none of the workbench's (plumb_bob: k1, k2, p1, p2, k3; equidistant: k1 to k4)."
    " Calibrate the camera again with one of them, by `workbench fit` with views of a board"
)
LENS_NAMES: Mapping[str, LensName] = {
    "plumb_bob": "plumb_bob",
    "radtan": "plumb_bob",
    "none": "plumb_bob",
    "equidistant": "equidistant",
    "equi": "equidistant",
    "fisheye": "equidistant",
    "rational_polynomial": "plumb_bob",
    "thin_prism": "plumb_bob",
}
"""Lens model by the names of others. A rational one is accepted where its further coefficients are 0."""
MRCAL_LENSES: Mapping[str, LensName] = {
    "LENSMODEL_PINHOLE": "plumb_bob",
    "LENSMODEL_OPENCV4": "plumb_bob",
    "LENSMODEL_OPENCV5": "plumb_bob",
    "LENSMODEL_OPENCV8": "plumb_bob",
    "LENSMODEL_OPENCV12": "plumb_bob",
}


def read_intrinsics(path: Path, camera: str | None = None) -> Intrinsics:
    """Intrinsics in a camera file of any known format, which its content shows.

    Args:
        path: file.
        camera: name of the camera in a file of several.

    Raises:
        BadInputError: the file is missing, of another kind, or its lens model is none of the workbench's.
    """
    content = read_file(path, EXPECTED, LARGEST_BYTES)
    if (got := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected {EXPECTED}, got {got}")
    text = content.decode("utf-8")
    if text.lstrip("\ufeff \n\r\t").startswith(("<?xml", "<opencv_storage")) or "!!opencv-matrix" in text:
        return _named(path, lambda: _of_opencv(text))
    if "LENSMODEL_" in text or "'lensmodel'" in text:
        return _named(path, lambda: _of_mrcal(text))
    data = parse_document(text, path).data
    return _named(path, lambda: _of_yaml(data, camera))


def _named(path: Path, read: Callable[[], Intrinsics]) -> Intrinsics:
    """Result of a reader; its errors and missing keys name the file."""
    try:
        return read()
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from None
    except (LookupError, TypeError, ValueError, OverflowError, AttributeError) as error:
        kind = f"no {error}" if isinstance(error, KeyError) else "values of another kind"
        raise BadInputError(f"{path}: expected {EXPECTED}, got {kind}") from None


def _of_yaml(data: Any, camera: str | None) -> Intrinsics:
    if not isinstance(data, dict):
        raise BadInputError(f"expected {EXPECTED}, got no mapping of keys to values")
    cameras = [str(key) for key, one in data.items() if isinstance(one, dict) and "intrinsics" in one]
    if cameras:
        return _of_kalibr(data, cameras, camera)
    if "camera_matrix" in data or any(key in data for key in ("K", "k")):
        return _of_ros(data)
    raise BadInputError(f"expected {EXPECTED}, got keys {', '.join(map(str, list(data)[:6]))}")


def _of_ros(data: Mapping[str, Any]) -> Intrinsics:
    """A calibration file, or a message as `ros2 topic echo` prints it."""
    matrix = _numbers(_data_of(data.get("camera_matrix", data.get("K", data.get("k")))), 9)
    given = data.get("distortion_coefficients", data.get("D", data.get("d"))) or []
    size = data.get("image_width", data.get("width")), data.get("image_height", data.get("height"))
    found = _perspective(
        ROS, size, matrix, _lens_of(str(data.get("distortion_model", "plumb_bob"))), _numbers(_data_of(given))
    )
    found = replace(found, sd=_stated_sd(data))
    region = data.get("roi") or {}
    if isinstance(region, dict) and region.get("width") and region.get("height"):
        found = found.cropped(*(int(region[key]) for key in ("x_offset", "y_offset", "width", "height")))
    return found


def _stated_sd(data: Mapping[str, Any]) -> dict[str, float]:
    """Deviations in the workbench's own calibrations, by parameter name."""
    block = data.get("laser_ranger") or data.get("workbench_camera")
    if not isinstance(block, dict):
        return {}
    stated = block["parameters"]
    return dict(zip(map(str, stated["names"]), _numbers(stated["sd"]), strict=True))


def _of_kalibr(data: Mapping[str, Any], cameras: Sequence[str], camera: str | None) -> Intrinsics:
    if camera is None and len(cameras) > 1:
        raise BadInputError(f"it has several cameras: name one of {', '.join(cameras)} by camera.name")
    if (name := camera or cameras[0]) not in cameras:
        raise BadInputError(f"camera.name: expected one of {', '.join(cameras)}, got {name}")
    one = data[name]
    if (kind := str(one.get("camera_model"))) != "pinhole":
        raise BadInputError(f"camera_model {kind}: {INSTEAD}")
    fx, fy, cx, cy = _numbers(one["intrinsics"], 4)
    matrix = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    lens = _lens_of(str(one.get("distortion_model", "none")))
    return _perspective(KALIBR, one["resolution"], matrix, lens, _numbers(one.get("distortion_coeffs") or []))


def _of_mrcal(text: str) -> Intrinsics:
    try:
        data = ast.literal_eval(text.strip())
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise BadInputError(f"expected a {MRCAL}, got text that is none") from None
    kind = str(data["lensmodel"])
    if (lens := MRCAL_LENSES.get(kind)) is None:
        raise BadInputError(f"lensmodel {kind}: {INSTEAD}")
    fx, fy, cx, cy, *coefficients = _numbers(data["intrinsics"])
    matrix = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    return _perspective(MRCAL, data["imagersize"], matrix, lens, coefficients)


def _of_opencv(text: str) -> Intrinsics:
    """A file of OpenCV's FileStorage, with the names that its calibration programs use."""
    import cv2

    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        return _of_storage(storage)
    except (cv2.error, SystemError) as error:
        raise BadInputError(f"expected an {OPENCV}, OpenCV cannot read it: {error}") from None


def _of_storage(storage: cv2.FileStorage) -> Intrinsics:
    k = _matrix(storage, "camera_matrix", "cameraMatrix", "Camera_Matrix", "camMatrix", "K", "M1")
    if not k:
        raise BadInputError("expected the key camera_matrix or cameraMatrix, got none")
    given = _matrix(storage, "distortion_coefficients", "dist_coeffs", "Distortion_Coefficients", "D", "D1")
    width, height = (
        _number(storage, "image_width", "image_Width"),
        _number(storage, "image_height", "image_Height"),
    )
    resolution = storage.getNode("cameraResolution")
    if resolution.isSeq() and resolution.size() == 2:
        width, height = (resolution.at(n).real() for n in (0, 1))
    lens: LensName = "equidistant" if _number(storage, "fisheye_model", "fisheye") else "plumb_bob"
    found = _perspective(OPENCV, (width, height), _numbers(k, 9), lens, given)
    stated = _matrix(storage, "cameraMatrix_std_dev")
    if len(stated) != 4:
        return found
    fx, fy, cx, cy = stated
    names = COEFFICIENTS[lens] if lens == "equidistant" else RATIONAL
    of_lens = dict(zip(names, _matrix(storage, "dist_coeffs_std_dev"), strict=False))
    sd = {"f_px": max(fx, fy), "cx_px": cx, "cy_px": cy} | of_lens
    # OpenCV writes 0 for what it held constant, which does not make it exact.
    return replace(found, sd={name: value for name, value in sd.items() if value > 0})


def _matrix(storage: cv2.FileStorage, *names: str) -> list[float]:
    """Numbers of the first matrix with one of these names, row by row; empty without one."""
    nodes = [storage.getNode(name) for name in names]
    found = next((node.mat() for node in nodes if node.isMap()), None)
    return [] if found is None else [float(value) for value in found.ravel()]


def _number(storage: cv2.FileStorage, *names: str) -> float | None:
    """The first number with one of these names."""
    nodes = [storage.getNode(name) for name in names]
    return next((float(node.real()) for node in nodes if node.isReal() or node.isInt()), None)


def _lens_of(name: str) -> LensName:
    if (lens := LENS_NAMES.get(name.lower() or "none")) is None:
        raise BadInputError(f"distortion_model {name}: {INSTEAD}")
    return lens


def _perspective(
    source: str, size: Any, matrix: Sequence[float], lens: LensName, coefficients: Sequence[float]
) -> Intrinsics:
    """Intrinsics by camera matrix (9, row by row) and coefficients in OpenCV's order."""
    fx, skew, cx, _, fy, cy, *_ = matrix
    if abs(skew) > NEGLIGIBLE * fx:
        raise BadInputError(f"expected no skew in the camera matrix, got {skew:g}")
    if not (fx > 0 and fy > 0):
        raise BadInputError(f"expected positive focal lengths, got {fx:g} and {fy:g}")
    names = COEFFICIENTS["equidistant"] if lens == "equidistant" else RATIONAL
    if len(coefficients) > len(names):
        raise BadInputError(f"{len(coefficients)} distortion coefficients: {INSTEAD}")
    named = dict(zip(names, coefficients, strict=False))
    foreign = [n for n, value in named.items() if n not in COEFFICIENTS[lens] and abs(value) > NEGLIGIBLE]
    if foreign:
        kind = "rational lens model" if foreign[0].startswith("k") else "thin-prism lens model"
        raise BadInputError(f"{kind} ({', '.join(foreign)} are not 0): {INSTEAD}")
    return Intrinsics(
        format=source,
        size_px=_size(size),
        f_px=(fx, fy),
        centre_px=(cx, cy),
        lens=lens,
        coefficients={name: value for name, value in named.items() if name in COEFFICIENTS[lens]},
    )


def _size(given: Any) -> tuple[int, int] | None:
    width, height = given
    return None if width is None or height is None else (int(width), int(height))


def _data_of(matrix: Any) -> Any:
    """Numbers of a matrix in the notation of OpenCV and ROS, or a plain list."""
    return matrix["data"] if isinstance(matrix, dict) else matrix


def _numbers(values: Any, count: int | None = None) -> list[float]:
    found = [float(value) for value in cast("Sequence[Any]", values)]
    if (count is not None and len(found) != count) or not all(map(isfinite, found)):
        raise BadInputError(f"expected {count or 'finite'} numbers, got {str(values)[:60]}")
    return found
