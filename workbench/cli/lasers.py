"""`workbench lasers off` and `workbench lasers state`."""

from __future__ import annotations

from pathlib import Path

from workbench.devices.registry import load_bench_rig, open_lasers, whole_bench
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.rig import Rig


def lasers_off(rig_path: Path) -> str:
    """Put every laser off; returns who confirmed it.

    Raises:
        BadInputError: the rig file is wrong, or names no controller.
        LaserOffNotConfirmedError: nobody confirmed it, for whatever reason.
    """
    rig = load_bench_rig(rig_path, kinds=("lasers",))
    if _is_virtual(rig):
        return _virtual(rig)
    try:
        lasers = open_lasers(rig)
        lasers.close()
    except RigNotReadyError as error:
        raise LaserOffNotConfirmedError(
            f"the lasers may be on: {error}. Treat the beams as on, cut the lasers' supply"
        ) from None
    return f"all lasers are off, confirmed by {lasers.identity}"


def _is_virtual(rig: Rig) -> bool:
    whole = whole_bench(rig)
    return whole is not None and whole.virtual


def _virtual(rig: Rig) -> str:
    return f"rig {rig.rig} is the virtual bench: its lasers end with the command that lights them"


def lasers_state(rig_path: Path) -> str:
    """What the controller tells, once its port is open; that puts every laser off.

    Raises:
        WorkbenchError: the rig file is wrong, or the controller does not answer.
    """
    rig = load_bench_rig(rig_path, kinds=("lasers",))
    if _is_virtual(rig):
        return _virtual(rig)
    lasers = open_lasers(rig)
    try:
        state = lasers.state()
    finally:
        lasers.close()
    told = {True: "closed", False: "open: nothing can be lit", None: "not told by this driver"}
    interlock = told[state.interlock_closed]
    lit = ", ".join(state.lit) or "none (opening the port puts all off)"
    return f"controller: {lasers.identity}\ninterlock:  {interlock}\nlit:        {lit}"
