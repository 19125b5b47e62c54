"""On-disk cache of traced JAX programs.

JAX caches compiled programs. It does not cache tracing and lowering, which take longer than everything else
in a cold `workbench fit`, and which need the import of optimistix. `jit_cached` is `jax.jit` with the lowered
program (StableHLO) stored in the cache folder, beside JAX's own files.
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
"""Distributions on whose version the lowered program depends."""
LAPACK = ("lapack_dormqr_ffi",)
"""Calls that JAX does not guarantee for later versions; a stored program serves one version only."""
SUM_BYTES = hashlib.sha256().digest_size
"""Length of the checksum before each stored program."""


def jit_cached(static: int = 0) -> Callable[[Program[T]], Program[T]]:
    """Compile a function of arrays as `jax.jit` does, and store the lowered program on disk.

    The function takes its arguments by position, and returns an array or a tuple of arrays.

    Args:
        static: number of trailing arguments that select the program (hashable, with a `repr`); all others are
            arrays.
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
    """The lowered program of a function, from the cache or traced and stored there."""
    path = CACHE / "programs" / hashlib.sha256(f"{_origin()}{key}".encode()).hexdigest()
    # A cache that cannot be read or written only costs time.
    with suppress(OSError):
        stored = path.read_bytes()
        if stored.startswith(_sum(stored[SUM_BYTES:])):
            return jax.export.deserialize(bytearray(stored[SUM_BYTES:]))
    unchecked = [jax.export.DisabledSafetyCheck.custom_call(name) for name in LAPACK]
    exported = jax.export.export(jax.jit(function), disabled_checks=unchecked)(*leaves)
    content = bytes(exported.serialize())
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, _sum(content) + content)
    return exported


def _sum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


@cache
def _origin() -> str:
    """Everything a program depends on beside its arguments: our sources, library versions, the backend."""
    sources = [path for package in (optics, calibration) for path in _sources(package.__path__[0])]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    return repr((digest, [_version(name) for name in TRACED_BY], jax.default_backend()))


def _version(name: str) -> str:
    """Version line of a distribution; `importlib.metadata.version` parses all metadata and is far slower."""
    metadata = distribution(name).read_text("METADATA") or version(name)
    return next((line for line in metadata.splitlines() if line.startswith("Version:")), metadata)


def _sources(folder: str) -> list[Path]:
    return sorted(Path(folder).rglob("*.py"))
