"""Is the rig ready? Each of its parts is tried, the lasers last."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import Bench, Operator, StreamingCamera
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, StoppedError
from workbench.model.exposure import CLIPPED
from workbench.model.prompt import Prompt
from workbench.model.rig import LaserSpec, Rig
from workbench.model.target import Placement
from workbench.procedure.capture.exposure import set_exposure
from workbench.procedure.capture.latency import LEASE_S, count_latency
from workbench.procedure.engine.prompts import placement_prompt, safety_prompt
from workbench.spots import Failure, find_spots

STANDOFF_MM = 500.0
MOST_FRAMES = 20
BRIGHT = 0.25
"""Of full scale: a spot's peak that leaves room for farther standoffs."""


@dataclass(frozen=True)
class CheckResult:
    """What came of one check."""

    part: str
    ok: bool
    found: str
    """What was found; where it is not well, what to do."""


def examine(rig: Rig, bench: Bench, operator: Operator) -> Iterator[CheckResult]:
    """Try every part of an opened bench.

    Raises:
        AnswerNeededError, StoppedError: nobody puts the target there, or confirms that it is safe.
        LaserOffNotConfirmedError: a beam stays on.
    """
    yield CheckResult("controller", True, f"answers, all lasers off, {bench.lasers.identity}")
    yield _interlock(bench)
    yield _tried("camera", partial(_camera, rig, bench))
    for prompt in (safety_prompt(rig), _target_prompt()):
        answer = operator.ask(prompt)
        if answer.action != "done":
            raise StoppedError(f"aborted by the operator at {prompt.key}: {answer.reason}")
    bench.target.place(_placement())
    # Before all that is looked at with the lasers lit: those pictures would be stale.
    yield _tried("latency", partial(_latency, rig, bench))
    yield from _exposure(rig, bench)
    for laser in rig.lasers:
        yield _tried(f"laser {laser.id}", partial(_laser, rig, bench, laser))


def _tried(part: str, check: Callable[[], str]) -> CheckResult:
    try:
        return CheckResult(part, True, check())
    except LaserOffNotConfirmedError:
        raise
    except RigNotReadyError as error:
        return CheckResult(part, False, str(error))


def _interlock(bench: Bench) -> CheckResult:
    closed = bench.lasers.state().interlock_closed
    if closed is None:
        return CheckResult("interlock", True, "not told by this driver; an open one refuses the lasers below")
    return CheckResult("interlock", closed, "closed" if closed else "open: close the door or the key switch")


def _camera(rig: Rig, bench: Bench) -> str:
    bench.mark("doctor/camera")
    image = bench.camera.grab().image
    expected = (rig.camera.height_px, rig.camera.width_px)
    if image.shape != expected:
        raise RigNotReadyError(
            f"expected {expected[1]} x {expected[0]} pixels as in the rig file, got"
            f" {image.shape[1]} x {image.shape[0]}; set the camera's mode or the rig file right"
        )
    if image.max() == image.min():
        raise RigNotReadyError(
            f"every pixel is {image.max()}: is the cap on, or does the driver deliver nothing?"
        )
    return f"{expected[1]} x {expected[0]}, {image.dtype.itemsize * 8} bits, median {np.median(image):.0f}"


def _exposure(rig: Rig, bench: Bench) -> Iterator[CheckResult]:
    """Set as for captures, where it can be set."""
    try:
        found = set_exposure(bench, rig, "doctor", bench.mark)
    except RigNotReadyError as error:
        yield CheckResult("exposure", False, str(error))
        return
    if found is not None:
        well = found.verdict != "unseen" and BRIGHT <= found.peak < CLIPPED
        yield CheckResult("exposure", well, found.text.removeprefix("exposure "))


def _laser(rig: Rig, bench: Bench, laser: LaserSpec) -> str:
    bench.mark(f"doctor/{laser.id}")
    with bench.lasers.lit([laser.id], for_s=LEASE_S):
        on = bench.camera.grab().image
    off = bench.camera.grab().image
    found = find_spots(on, off, scanlines=[prior_scanline(rig, laser)], expected=1)
    if len(found.spots) != 1:
        said = ", ".join(found.failures) or f"{len(found.spots)} spots"
        raise RigNotReadyError(
            f"not seen ({said}): does it shine on the target at {STANDOFF_MM:g} mm, and is it on this line of"
            " the controller?"
        )
    spot = found.spots[0]
    share = spot.peak_dn / (2**rig.camera.bits - 1)
    where = f"u {spot.u_px:.1f} v {spot.v_px:.1f} px, peak {100 * share:.0f} % of full scale"
    if Failure.SATURATED in spot.flags:
        raise RigNotReadyError(f"{where}: saturated; shorten the exposure or lower the gain")
    if share < BRIGHT:
        raise RigNotReadyError(f"{where}: too dim; lengthen the exposure, look for dirt on the optics")
    return where


def _latency(rig: Rig, bench: Bench) -> str:
    if not isinstance(bench.camera, StreamingCamera):
        return "not told by this driver"
    bench.mark("doctor/latency")
    frames = count_latency(bench.lasers, bench.camera, rig, MOST_FRAMES)
    if frames > (believed := bench.camera.discard_frames):
        bench.camera.discard_frames = frames  # for the checks that follow
        raise RigNotReadyError(
            f"{frames} frames, the driver discards {believed}: captures would show what"
            " was before; put a measure_latency step first in the procedure"
        )
    return f"{frames} frames"


def _placement() -> Placement:
    return Placement(key="doctor", standoff_mm=STANDOFF_MM)


def _target_prompt() -> Prompt:
    return replace(placement_prompt(_placement(), before=None), may={})  # it is all that there is
