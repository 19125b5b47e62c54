"""Rigs with other priors: parameters fixed at the rig file's value (nested models), or known otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from workbench.model.errors import BadInputError
from workbench.model.prior import Prior
from workbench.model.rig import TARGET_TILT, Rig
from workbench.model.yamlfile import FileModel

TILTS = "tilts"
"""Name of the tilts of all placements of the target, as one term."""
Part = TypeVar("Part", bound=FileModel)


def fix_parameters(rig: Rig, names: Iterable[str]) -> Rig:
    """Rig with parameters made constant, by their names in the calibration: `k2`, `L1.tx`; or `tilts`.

    Either slope of the common tilt stands for both: the rig file states one sd for the two.

    Raises:
        BadInputError: the rig has no such parameter.
    """
    for name in names:
        rig = _fix_one(rig, name)
    return rig


def with_prior(rig: Rig, name: str, value: float | None = None, sd: float | None = None) -> Rig:
    """Rig with another prior of one parameter; None keeps the rig's value or standard deviation.

    Raises:
        BadInputError: the rig has no such parameter.
    """

    def change(prior: Prior) -> Prior:
        return Prior(value=prior.value if value is None else value, sd=prior.sd if sd is None else sd)

    return _changed(rig, name, change)


def _fix_one(rig: Rig, name: str) -> Rig:
    if name == TILTS:
        return _with_bench(rig, "tilt_sd_deg", 0.0)
    if name in TARGET_TILT:
        return _with_bench(rig, "target_tilt_sd_deg", 0.0)
    return _changed(rig, name, lambda prior: Prior(value=prior.value, sd=0.0))


def _changed(rig: Rig, name: str, change: Callable[[Prior], Prior]) -> Rig:
    """Rig with a changed prior of the parameter with this name."""
    laser_id, _, of_ray = name.rpartition(".")
    if laser_id in rig.laser_ids and of_ray in _priors(rig.lasers[0]):
        index = rig.laser_ids.index(laser_id)
        laser = _with_changed(rig.lasers[index], of_ray, change)
        return rig.model_copy(update={"lasers": (*rig.lasers[:index], laser, *rig.lasers[index + 1 :])})
    if name in rig.camera.lens_priors:
        return rig.model_copy(update={"camera": _with_changed(rig.camera, name, change)})
    if name in _priors(rig.bench):
        return rig.model_copy(update={"bench": _with_changed(rig.bench, name, change)})
    rays = [f"{i}.{p}" for i in rig.laser_ids for p in _priors(rig.lasers[0])]
    known = ", ".join([*rig.camera.lens_priors, *_priors(rig.bench), *TARGET_TILT, TILTS, *rays])
    raise BadInputError(f"parameter {name}: expected one of {known}")


def _with_bench(rig: Rig, key: str, value: float) -> Rig:
    return rig.model_copy(update={"bench": rig.bench.model_copy(update={key: value})})


def _priors(part: FileModel) -> list[str]:
    return [name for name, value in part if isinstance(value, Prior)]


def _with_changed(part: Part, name: str, change: Callable[[Prior], Prior]) -> Part:
    return part.model_copy(update={name: change(getattr(part, name))})
