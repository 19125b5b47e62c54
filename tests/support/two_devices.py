"""Batch fit on two devices, as a process of its own: XLA counts its devices once.

Call: XLA_FLAGS=--xla_force_host_platform_device_count=2 python -m tests.support.two_devices. The output is
JSON. `used` are the devices of all sensors, and of each half. `equal` states whether the halves are
bit-identical with the whole. `sharded` has the largest difference of a program over both devices, in sd.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import jax
import numpy as np
from jax import Array
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from tests.support.rigs import thesis_rig
from workbench.calibration.design.simulation import simulate_calibrations
from workbench.calibration.estimation import batch
from workbench.calibration.estimation.batch import CHUNK, BatchFit

STANDOFFS_MM = (125.0, 200.0, 330.0, 600.0, 1200.0, 2500.0)
SENSORS = 2 * CHUNK
FIELDS = ("values", "sensor_covariance", "placement_covariance", "noise_scale", "chi2", "converged")


def main() -> None:
    """Fit the same sensors in three ways."""
    calls: list[tuple[Any, ...]] = []
    solve, fit, fits = batch._solve_chunk, batch.fit_batch, list[tuple[Any, ...]]()
    used: list[list[int]] = []

    def recorded(*arguments: Any) -> tuple[Array, ...]:
        calls.append(arguments)
        found = solve(*arguments)
        used[-1] += [device.id for device in found[0].devices()]
        return found

    def by_halves(*arguments: Any) -> BatchFit:
        fits.append(arguments)
        return fit(*arguments)

    with (
        patch.object(batch, "_solve_chunk", recorded),
        patch("workbench.calibration.design.simulation.fit_batch", by_halves),
    ):
        used.append([])
        rng = np.random.default_rng(5)
        whole = simulate_calibrations(thesis_rig(), STANDOFFS_MM, 5, SENSORS, rng).fit
        first = calls[0]
        rig, placements, position, sd = fits[0]
        halves = []
        for device, half in zip(jax.devices(), np.split(position, 2), strict=True):
            used.append([])
            with jax.default_device(device):
                halves.append(fit(rig, placements, half, sd))
    equal = {
        name: bool(
            np.array_equal(getattr(whole, name), np.concatenate([getattr(part, name) for part in halves]))
        )
        for name in FIELDS
    }
    print(json.dumps({"used": [sorted(set(one)) for one in used], "equal": equal, "sharded": sharded(first)}))


def sharded(arguments: tuple[Any, ...]) -> dict[str, object]:
    """One chunk of fits, sharded over the sensors of both devices, and the same on one device."""
    shared, fits, static = arguments[:3], arguments[3:6], arguments[6:]
    program = jax.jit(inspect.unwrap(batch._solve_chunk), static_argnums=(6, 7))
    partition: Callable[[str], PartitionSpec] = PartitionSpec
    over_sensors = NamedSharding(Mesh(np.array(jax.devices()), ("sensor",)), partition("sensor"))
    ours = program(*shared, *(jax.device_put(one, over_sensors) for one in fits), *static)
    theirs = program(*shared, *fits, *static)
    sd = np.sqrt(np.diagonal(np.asarray(theirs[1]), axis1=1, axis2=2))
    difference = np.abs(np.asarray(ours[0]) - np.asarray(theirs[0]))[:, : sd.shape[1]] / sd
    return {"devices": len(ours[0].devices()), "difference_sd": float(difference.max())}


if __name__ == "__main__":
    main()
