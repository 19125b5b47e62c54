"""Intrinsics of a camera from a file that another program wrote, as the priors of a rig's camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from workbench.model.errors import BadInputError
from workbench.model.lens import COEFFICIENTS, LensName

LARGEST_ASPECT = 0.005
"""Largest relative difference of the two focal lengths. Half the difference adds to the sd of their mean."""
FACTORS = (1, 2, 3, 4, 6, 8)
"""Factors by which cameras bin pixels."""
OFF_CENTRE = 0.25
"""Largest distance of the principal point from the middle of an image whose size the file does not state, as
a share of the side."""
ESTIMATED_F_SD = 0.005
"""Relative: typical difference between good calibrations of one camera at one focus."""
ESTIMATED_CENTRE_SD = 0.005
"""Typical difference of the principal point between them, as a share of the image's width."""
ESTIMATED_SD = {"k1": 0.02, "k2": 0.1, "k3": 0.2, "k4": 0.2, "p1": 0.002, "p2": 0.002}
"""Typical differences of the distortion coefficients between them."""


@dataclass(frozen=True)
class Intrinsics:
    """Intrinsics as a file states them, in OpenCV's convention: the first pixel's centre is (0, 0)."""

    format: str
    """Name of the file's format, for messages."""
    size_px: tuple[int, int] | None
    """Width and height of the images; None: not stated."""
    f_px: tuple[float, float]
    centre_px: tuple[float, float]
    lens: LensName
    coefficients: Mapping[str, float]
    """Distortion coefficients of the lens model by name; others are 0."""
    sd: Mapping[str, float] = field(default_factory=dict)
    """Stated deviations by parameter name, 1 sigma."""

    def cropped(self, x_px: int, y_px: int, width_px: int, height_px: int) -> Intrinsics:
        """Intrinsics of a region of the image."""
        centre = self.centre_px[0] - x_px, self.centre_px[1] - y_px
        return replace(self, centre_px=centre, size_px=(width_px, height_px))

    def scaled(self, factor: float, size_px: tuple[int, int]) -> Intrinsics:
        """Intrinsics of the image with its size multiplied, as by binning."""
        (fx, fy), (cx, cy) = self.f_px, self.centre_px
        sd = {name: value * factor if name.endswith("_px") else value for name, value in self.sd.items()}
        return replace(
            self,
            size_px=size_px,
            f_px=(fx * factor, fy * factor),
            centre_px=((cx + 0.5) * factor - 0.5, (cy + 0.5) * factor - 0.5),
            sd=sd,
        )


def for_image(found: Intrinsics, size_px: tuple[int, int]) -> Intrinsics:
    """Intrinsics for images of another size, if these are binned by a whole number.

    Raises:
        BadInputError: the image may be cropped, by an amount that the file does not state.
    """
    width, height = size_px
    if found.size_px is None:
        return _plausible(found, size_px)
    if found.size_px == size_px:
        return found
    for factor in FACTORS:
        for share in (1.0 / factor, float(factor)):
            if (_binned(found.size_px[0], share), _binned(found.size_px[1], share)) == size_px:
                return found.scaled(share, size_px)
    raise BadInputError(
        f"expected images of {found.size_px[0]} x {found.size_px[1]} pixels as in the {found.format}, or"
        f" binned by a whole number, got {width} x {height}: the image may be cropped, by an unknown amount."
        " State f_px, cx_px and cy_px of this mode, or calibrate in it"
    )


def _binned(side_px: int, share: float) -> int:
    """Side of a binned image: incomplete pixels at its end are dropped."""
    return int(side_px * share + 1e-9)


def _plausible(found: Intrinsics, size_px: tuple[int, int]) -> Intrinsics:
    for name, centre, side in zip(("cx", "cy"), found.centre_px, size_px, strict=True):
        if abs(centre - side / 2) > OFF_CENTRE * side:
            raise BadInputError(
                f"the {found.format} does not state the size of its images, and its {name} {centre:g} is not"
                f" near the middle of {size_px[0]} x {size_px[1]} pixels; is it of another mode? State f_px,"
                " cx_px and cy_px instead"
            )
    return replace(found, size_px=size_px)


def camera_values(found: Intrinsics) -> dict[str, object]:
    """Values of a rig file's `camera` by key: size, lens, and a prior of each parameter.

    Deviations that the file does not state are estimated.

    Raises:
        BadInputError: the pixels are not square.
    """
    if found.size_px is None:
        raise BadInputError(f"the {found.format} states no size of its images; state width_px and height_px")
    (fx, fy), (cx, cy) = found.f_px, found.centre_px
    f = (fx + fy) / 2
    if not abs(fx - fy) <= LARGEST_ASPECT * f:
        raise BadInputError(
            f"expected square pixels (fx = fy within {100 * LARGEST_ASPECT:g} %), got {fx:g} and {fy:g}."
            " Calibrate with one focal length (in OpenCV: CALIB_FIX_ASPECT_RATIO)"
        )
    width = found.size_px[0]
    estimated = {"f_px": ESTIMATED_F_SD * f, "cx_px": ESTIMATED_CENTRE_SD * width}
    estimated |= {"cy_px": estimated["cx_px"], **ESTIMATED_SD}
    sd = {**estimated, **found.sd}
    sd["f_px"] = (sd["f_px"] ** 2 + ((fx - fy) / 2) ** 2) ** 0.5
    values = {"f_px": f, "cx_px": cx, "cy_px": cy}
    values |= {name: found.coefficients.get(name, 0.0) for name in COEFFICIENTS[found.lens]}
    priors = {name: {"value": value, "sd": sd[name]} for name, value in values.items()}
    return {"width_px": width, "height_px": found.size_px[1], "lens": found.lens, **priors}
