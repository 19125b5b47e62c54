"""Check of all parts of a rig: controller, interlock, camera, latency, exposure, lasers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from workbench.calibration.data.spot_rows import own_spots, sought
from workbench.devices.protocols import Bench, Camera, LaserBank, Operator, StreamingCamera
from workbench.devices.real_bench import open_camera, open_lasers, open_target
from workbench.devices.registry import open_bench, whole_bench
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, StoppedError
from workbench.model.exposure import CLIPPED
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import LaserSpec, Rig
from workbench.model.target import Placement
from workbench.procedure.capture.automatic import find_automatic_control
from workbench.procedure.capture.exposure import set_exposure
from workbench.procedure.capture.latency import LEASE_S, count_latency
from workbench.procedure.engine.prompts import laser_class_prompt, placement_prompt, safety_prompt
from workbench.spots import Failure, find_spots
from workbench.spots.jpeg_blocks import has_jpeg_blocks

STANDOFF_MM = 500.0
"""Standoff of the target during the check."""
MOST_FRAMES = 20
"""Largest latency that is measured, frames."""
LEAST_PEAK = 0.25
"""Least peak of a spot as a share of full scale, with reserve for farther standoffs."""


@dataclass(frozen=True)
class CheckResult:
    """Result of one check."""

    part: str
    ok: bool
    found: str
    """Finding; after a failure also what to do."""
    kind: Literal["checked", "noted", "not checked"] = "checked"
    """`noted`: to be mended, but no hindrance. `not checked`: the part needs others that have failed."""


def examine_rig(
    rig: Rig, session_dir: Path, operator_of: Callable[[Bench], Operator]
) -> Iterator[CheckResult]:
    """Open the devices of a rig and check every part; a device that fails does not end the check.

    Args:
        rig: rig.
        session_dir: folder beside which an emulated bench writes its files.
        operator_of: operator for an opened bench.

    Raises:
        BadInputError: the rig names no usable devices.
        AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `examine`.
    """
    if whole_bench(rig) is not None:
        with open_bench(rig, session_dir) as bench:
            yield from examine(rig, bench, operator_of(bench))
        return
    with ExitStack() as stack:
        lasers: LaserBank | None = None
        try:
            lasers = stack.enter_context(closing(open_lasers(rig)))
        except RigNotReadyError as error:
            yield CheckResult("controller", False, str(error))
            yield _not_checked("interlock", "the controller")
        else:
            yield from _controller(lasers)
        try:
            camera = stack.enter_context(closing(open_camera(rig, lasers.beat if lasers else lambda: None)))
        except RigNotReadyError as error:
            yield CheckResult("camera", False, str(error))
        else:
            yield _tried("camera", partial(_camera, rig, camera))
            if lasers is not None:
                bench = Bench(camera, lasers, open_target(rig))
                yield from _with_emission(rig, bench, operator_of(bench))
                return
        laser_checks = [f"laser {laser.id}" for laser in rig.lasers]
        for part in ("latency", "exposure", "automatic control", *laser_checks):
            yield _not_checked(part, "controller and camera")


def examine(rig: Rig, bench: Bench, operator: Operator) -> Iterator[CheckResult]:
    """Check every part of an opened bench.

    Raises:
        AnswerNeededError, StoppedError: the operator does not confirm safety or the target's placement.
        LaserOffNotConfirmedError: a beam stays on.
    """
    yield from _controller(bench.lasers)
    bench.mark("doctor/camera")
    yield _tried("camera", partial(_camera, rig, bench.camera))
    yield from _compression(bench.camera)
    yield from _with_emission(rig, bench, operator)


def _controller(lasers: LaserBank) -> Iterator[CheckResult]:
    yield CheckResult("controller", True, f"answers, all lasers off, {lasers.identity}")
    yield _interlock(lasers)


def _with_emission(rig: Rig, bench: Bench, operator: Operator) -> Iterator[CheckResult]:
    """Checks that switch lasers on, after safety and the target's placement are confirmed."""
    if rig.laser_class is None and not bench.virtual:
        answer = _asked(operator, laser_class_prompt())
        rig = rig.model_copy(update={"laser_class": answer})
        text = f'the rig file does not state it; add the line laser_class: "{answer}"'
        yield CheckResult("laser class", True, text, kind="noted")
    for prompt in (safety_prompt(rig), _target_prompt()):
        _asked(operator, prompt)
    bench.target.place(_placement())
    # The latency comes first: without it the frames of the later checks could be stale.
    yield _tried("latency", partial(_latency, rig, bench))
    yield from _exposure(rig, bench)
    yield from _automatic_control(rig, bench)
    for laser in rig.lasers:
        yield _tried(f"laser {laser.id}", partial(_laser, rig, bench, laser))


def _asked(operator: Operator, prompt: Prompt) -> float | str | None:
    answer = operator.ask(prompt)
    if answer.action != "done":
        raise StoppedError(f"aborted by the operator at {prompt.key}: {answer.reason}")
    return answer.value


def _not_checked(part: str, needs: str) -> CheckResult:
    return CheckResult(part, True, f"not checked: it needs {needs}", kind="not checked")


def _tried(part: str, check: Callable[[], str]) -> CheckResult:
    try:
        return CheckResult(part, True, check())
    except LaserOffNotConfirmedError:
        raise
    except RigNotReadyError as error:
        return CheckResult(part, False, str(error))


def _interlock(lasers: LaserBank) -> CheckResult:
    try:
        closed = lasers.state().interlock_closed
    except RigNotReadyError as error:
        return CheckResult("interlock", False, str(error))
    if closed is None:
        return CheckResult(
            "interlock", True, "not reported by this driver; an open interlock makes the laser checks fail"
        )
    return CheckResult("interlock", closed, "closed" if closed else "open: close the door or the key switch")


def _camera(rig: Rig, camera: Camera) -> str:
    image = camera.grab().image
    expected = (rig.camera.height_px, rig.camera.width_px)
    if image.shape != expected:
        raise RigNotReadyError(
            f"expected {expected[1]} x {expected[0]} pixels (rig file), got"
            f" {image.shape[1]} x {image.shape[0]}; correct the camera's mode or the rig file"
        )
    if image.max() == image.min():
        raise RigNotReadyError(
            f"every pixel has the value {image.max()}; remove the lens cap, or check the camera's driver"
        )
    return f"{expected[1]} x {expected[0]}, {image.dtype.itemsize * 8} bits, median {np.median(image):.0f}"


def _compression(camera: Camera) -> Iterator[CheckResult]:
    """Look for the blocks of JPEG in a frame."""
    try:
        compressed = has_jpeg_blocks(camera.grab().image)
    except RigNotReadyError:
        return  # the check of the camera names it
    if compressed:
        text = (
            "the frames show the blocks of JPEG compression, which moves spots; choose an uncompressed"
            " pixel_format (GREY, YUYV) in the rig file"
        )
        yield CheckResult("compression", True, text, kind="noted")


def _exposure(rig: Rig, bench: Bench) -> Iterator[CheckResult]:
    """Set the exposure as for captures, if it can be set."""
    try:
        found = set_exposure(bench, rig, "doctor", bench.mark)
    except RigNotReadyError as error:
        yield CheckResult("exposure", False, str(error))
        return
    if found is not None:
        ok = found.verdict != "unseen" and LEAST_PEAK <= found.peak < CLIPPED
        yield CheckResult("exposure", ok, found.text.removeprefix("exposure "))


def _automatic_control(rig: Rig, bench: Bench) -> Iterator[CheckResult]:
    """Look for automatic exposure, gain or white balance that the driver has not switched off."""
    if not isinstance(bench.camera, StreamingCamera):
        return
    part = "automatic control"
    bench.mark("doctor/automatic")
    try:
        remark = find_automatic_control(bench.lasers, bench.camera, rig).text
    except RigNotReadyError as error:
        yield CheckResult(part, False, str(error))
        return
    if not remark:
        yield CheckResult(part, True, "none: neither image nor spot darkens while a laser is on")
        return
    yield CheckResult(part, True, remark, kind="noted")


def _laser(rig: Rig, bench: Bench, laser: LaserSpec) -> str:
    bench.mark(f"doctor/{laser.id}")
    scanlines, expected = sought(rig, laser)
    with bench.lasers.lit([laser.id], for_s=LEASE_S):
        on = bench.camera.grab().image
    off = bench.camera.grab().image
    found = find_spots(
        on,
        off,
        scanlines=scanlines,
        expected=expected,
        speckle_sd_px=rig.noise.speckle_sd_px,
    )
    found = own_spots(rig, laser, found)
    if len(found.spots) != 1:
        got = ", ".join(found.failures) or counted(len(found.spots), "spot")
        raise RigNotReadyError(
            f"expected one spot, got {got}; check that the beam hits the target at {STANDOFF_MM:g} mm and"
            " that the laser is connected to this line of the controller"
        )
    spot = found.spots[0]
    share = spot.peak_dn / (2**rig.camera.bits - 1)
    where = f"u {spot.u_px:.1f} v {spot.v_px:.1f} px, peak {100 * share:.0f} % of full scale"
    if Failure.SATURATED in spot.flags:
        raise RigNotReadyError(f"{where}: saturated; shorten the exposure or lower the gain")
    if share < LEAST_PEAK:
        raise RigNotReadyError(
            f"{where}: too dim, expected at least {100 * LEAST_PEAK:.0f} %; lengthen the exposure, clean the"
            " optics"
        )
    return where


def _latency(rig: Rig, bench: Bench) -> str:
    if not isinstance(bench.camera, StreamingCamera):
        return "not measurable with this driver"
    bench.mark("doctor/latency")
    frames = count_latency(bench.lasers, bench.camera, rig, MOST_FRAMES)
    if frames > (discarded := bench.camera.discard_frames):
        bench.camera.discard_frames = frames  # for the checks that follow
        raise RigNotReadyError(
            f"{frames} frames, but the driver discards only {discarded}: captures would use stale frames;"
            " begin the procedure with a measure_latency step"
        )
    return f"{frames} frames"


def _placement() -> Placement:
    return Placement(key="doctor", standoff_mm=STANDOFF_MM)


def _target_prompt() -> Prompt:
    return replace(placement_prompt(_placement(), before=None), may={})  # nothing to redo or to skip
