"""Compiled programs that outlive the process: a second `workbench fit` neither traces nor compiles.

JAX's own persistent cache saves the compilation alone; tracing the solver and importing what it is made of
takes longer than all the rest of a fit. Here the compiled program itself is kept, in the user's cache folder,
under a key of everything that it was made from. Whatever is wrong with the folder or a file of it, the
program is compiled anew.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
from collections.abc import Callable, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, TypeVar

import jax
import numpy as np
from jax.experimental.serialize_executable import deserialize_and_load, serialize

import workbench.optics  # noqa: F401 - programs are of 64 bits
from workbench.session.files import write_atomically

R = TypeVar("R")
KEPT_PROGRAMS = 100
"""One is some 100 KiB; the oldest go."""
DIGEST_BYTES = 32


def stored(*static: int) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """`jax.jit` for a function of arrays, and containers of arrays, whose program is kept between processes.

    Args:
        static: positions of arguments that are constants of the program; their `repr` tells them apart.
    """

    def decorate(function: Callable[..., R]) -> Callable[..., R]:
        return _Stored(function, static)

    return decorate


class _Stored(Generic[R]):
    def __init__(self, function: Callable[..., R], static: Sequence[int]) -> None:
        self._function, self._static = function, static
        self._programs: dict[str, Callable[..., R]] = {}

    def __call__(self, *args: Any) -> R:
        fixed = {i: args[i] for i in self._static}
        leaves, tree = jax.tree.flatten([a for i, a in enumerate(args) if i not in fixed])
        if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
            return self._function(*args)
        arrays = [np.asarray(leaf) for leaf in leaves]
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        shapes = [(a.shape, a.dtype.str) for a in arrays]
        key = f"{name} {fixed!r} {tree} {shapes} {_environment()}"
        if key not in self._programs:
            self._programs[key] = _load(key) or self._compile(key, arrays, tree, fixed)
        return self._programs[key](*arrays)

    def _compile(
        self, key: str, arrays: Sequence[np.ndarray], tree: Any, fixed: dict[int, Any]
    ) -> Callable[..., R]:
        def flat(*leaves: Any) -> R:
            whole = jax.tree.unflatten(tree, leaves)
            for position in sorted(fixed):
                whole.insert(position, fixed[position])
            return self._function(*whole)

        program = jax.jit(flat).lower(*arrays).compile()
        _save(key, program)
        return program


def cache_folder() -> Path | None:
    """Where programs are kept; None where nobody but the user can be trusted to have written there."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    try:
        root = Path(base) if Path(base).is_absolute() else Path.home() / ".cache"
        folder = root / "laser-range-workbench" / "programs"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        about = folder.stat()
    except (OSError, RuntimeError):
        return None
    # A stored program is run as it is: nobody else may have put it there.
    private = not hasattr(os, "getuid") or (about.st_uid == os.getuid() and not about.st_mode & 0o022)
    return folder if private else None


def _load(key: str) -> Callable[..., Any] | None:
    folder = cache_folder()
    if folder is None:
        return None
    try:
        content = (folder / _file_name(key)).read_bytes()
        digest, payload = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        if hashlib.sha256(payload).digest() != digest:
            return None
        program, in_tree, out_tree = pickle.loads(payload)  # noqa: S301 - the folder is the user's own
        if b"lapack_" in program:
            _load_lapack()
        loaded: Callable[..., Any] = deserialize_and_load(program, in_tree, out_tree)
    except Exception:  # a program is only ever a saving of time
        return None
    return loaded


def _save(key: str, program: Any) -> None:
    folder = cache_folder()
    if folder is None:
        return
    try:
        payload = pickle.dumps(serialize(program))
        write_atomically(folder / _file_name(key), hashlib.sha256(payload).digest() + payload)
        by_age = sorted(folder.glob("*.bin"), key=lambda path: path.stat().st_mtime)
        for path in by_age[:-KEPT_PROGRAMS]:
            path.unlink(missing_ok=True)
    except Exception:  # a read-only folder, a full disk, a program that cannot be stored: nothing is lost
        return


def _file_name(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest() + ".bin"


@cache
def _load_lapack() -> None:
    """Programs call LAPACK by pointers that JAX sets when it first lowers such a call."""
    jax.jit(jax.lax.linalg.cholesky).lower(np.ones((1, 1)))


@cache
def _environment() -> str:
    """Everything beside the arguments that a program depends on."""
    source = hashlib.sha256()
    for room in ("calibration", "optics"):
        for path in sorted((Path(__file__).parents[1] / room).glob("*.py")):
            source.update(path.read_bytes())
    try:
        processor = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if "flags" in line)
    except (OSError, StopIteration):
        processor = platform.processor()
    parts = (jax.__version__, version("jaxlib"), np.__version__, platform.platform(), processor)
    return " ".join((*parts, os.environ.get("XLA_FLAGS", ""), source.hexdigest()))
