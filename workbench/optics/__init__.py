"""Geometry of lens, rays and target, in JAX; no input or output.

Importing this package switches JAX to 64 bits: a micrometre at five metres needs 9 digits, 32 bits have 7. It
also stores compiled programs in the user's cache folder, so that a second `workbench fit` does not compile.
"""

import os
from pathlib import Path

import jax

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "laser-range-workbench"
"""Folder of compiled programs; it can be deleted, which costs some seconds of compilation."""

for _name, _value in (
    ("jax_enable_x64", True),
    ("jax_compilation_cache_dir", str(CACHE / "jax")),
    ("jax_persistent_cache_min_compile_time_secs", 0.0),
    # A cache that cannot be written is ignored.
    ("jax_raise_persistent_cache_errors", False),
):
    jax.config.update(_name, _value)  # type: ignore[no-untyped-call]
