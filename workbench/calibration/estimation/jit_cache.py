"""Traced programs kept on disk, so that a second process need not trace them again.

JAX keeps what it has compiled. It does not keep the tracing and lowering before that, which take longer than
all else that a cold `workbench fit` does, and for which optimistix has to be imported. `jit_cached` is
`jax.jit` with the lowered program (StableHLO) kept in the cache folder, beside JAX's own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache, wraps
from importlib.metadata import distribution, version
from pathlib import Path
from typing import Any, TypeVar

import jax
import numpy as np

from workbench import calibration, optics
from workbench.optics import CACHE
from workbench.session.files import write_atomically

T = TypeVar("T")
Program = Callable[..., T]
TRACED_BY = ("jax", "jaxlib", "optimistix", "lineax", "equinox", "numpy")
"""Distributions whose version makes another program of the same function."""
LAPACK = ("lapack_dormqr_ffi",)
"""What JAX promises for no later version than its own; a program is kept for one version only."""
SUM_BYTES = hashlib.sha256().digest_size


def jit_cached(static: int = 0) -> Callable[[Program[T]], Program[T]]:
    """Compile a function of arrays as `jax.jit` does, and keep the lowered program on disk.

    The function takes its arguments by position, and returns an array or a tuple of arrays.

    Args:
        static: how many of the last arguments are no arrays but choose the program (hashable, with a `repr`).
    """

    def decorate(function: Program[T]) -> Program[T]:
        programs: dict[Any, Program[T]] = {}

        @wraps(function)
        def call(*args: Any) -> T:
            arrays, statics = args[: len(args) - static], args[len(args) - static :]
            leaves, tree = jax.tree.flatten(arrays)
            if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):  # part of a larger program
                return function(*args)
            leaves = [leaf if isinstance(leaf, jax.Array) else np.asarray(leaf) for leaf in leaves]
            shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
            program = programs.get((tree, statics, shapes))
            if program is None:

                def flat(*leaves: jax.Array) -> T:
                    return function(*jax.tree.unflatten(tree, leaves), *statics)

                name = f"{function.__module__}.{function.__qualname__}"
                program = jax.jit(_lowered(flat, leaves, repr((name, statics, str(tree), shapes))).call)
                programs[tree, statics, shapes] = program
            return program(*leaves)

        return call

    return decorate


def _lowered(function: Program[T], leaves: list[jax.Array], key: str) -> jax.export.Exported:
    """The function's program, from disk where it is there."""
    path = CACHE / "programs" / hashlib.sha256(f"{_origin()}{key}".encode()).hexdigest()
    # What cannot be read or written is no cache, and nothing worse.
    with suppress(OSError):
        stored = path.read_bytes()
        if stored.startswith(_sum(stored[SUM_BYTES:])):
            return jax.export.deserialize(bytearray(stored[SUM_BYTES:]))
    unpromised = [jax.export.DisabledSafetyCheck.custom_call(name) for name in LAPACK]
    exported = jax.export.export(jax.jit(function), disabled_checks=unpromised)(*leaves)
    content = bytes(exported.serialize())
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, _sum(content) + content)
    return exported


def _sum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


@cache
def _origin() -> str:
    """What a program depends on beside its function's arguments: our maths, the tracers, the processor."""
    sources = [path for room in (optics, calibration) for path in _sources(room.__path__[0])]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    return repr((digest, [_version(name) for name in TRACED_BY], jax.default_backend()))


def _version(name: str) -> str:
    """Of a distribution; `importlib.metadata.version` parses all that is told of it, and takes far longer."""
    told = distribution(name).read_text("METADATA") or version(name)
    return next((line for line in told.splitlines() if line.startswith("Version:")), told)


def _sources(folder: str) -> list[Path]:
    return sorted(Path(folder).rglob("*.py"))
