"""`workbench lasers off` and `workbench lasers state`."""

from __future__ import annotations

from pathlib import Path

from workbench.devices.registry import load_bench_rig, open_lasers, whole_bench
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.rig import Rig

INTERLOCK = {
    True: "closed",
    False: "open: no laser can be switched on",
    None: "not reported by this driver",
}
"""Text for the state of the interlock."""


def lasers_off(rig_path: Path) -> str:
    """Switch every laser off; returns a message with the device that confirmed it.

    Raises:
        BadInputError: the rig file is wrong, or names no laser driver.
        LaserOffNotConfirmedError: the device did not confirm it.
    """
    rig = load_bench_rig(rig_path, kinds=("lasers",))
    if _is_virtual(rig):
        return _virtual(rig)
    try:
        lasers = open_lasers(rig)
        lasers.close()
    except RigNotReadyError as error:
        raise LaserOffNotConfirmedError(
            f"the lasers may be on: {error}. Treat the beams as on; cut the lasers' power"
        ) from None
    return f"all lasers are off, confirmed by {lasers.identity}"


def _is_virtual(rig: Rig) -> bool:
    whole = whole_bench(rig)
    return whole is not None and whole.virtual


def _virtual(rig: Rig) -> str:
    return f"rig {rig.rig} is a virtual bench: its lasers go off when the command that uses them ends"


def lasers_state(rig_path: Path) -> str:
    """State of the laser controller; opening its port switches every laser off.

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
    interlock = INTERLOCK[state.interlock_closed]
    lit = ", ".join(state.lit) or "none (opening the port switches all off)"
    return f"controller: {lasers.identity}\ninterlock:  {interlock}\non:         {lit}"
