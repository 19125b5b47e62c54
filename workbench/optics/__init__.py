"""Pure maths of lens, rays and target, in JAX; no input or output.

Importing this room switches JAX to 64 bits: a micrometre at five metres needs 9 digits, 32 bits have 7. It
also lets JAX keep what it has compiled in the cache folder of the user, so that the second `workbench fit`
need not compile.
"""

import os
from pathlib import Path

import jax

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "laser-range-workbench"
"""What can be made again, at the price of some seconds."""

for _name, _value in (
    ("jax_enable_x64", True),
    ("jax_compilation_cache_dir", str(CACHE / "jax")),
    ("jax_persistent_cache_min_compile_time_secs", 0.0),
    # A cache that cannot be written is no cache, and nothing worse.
    ("jax_raise_persistent_cache_errors", False),
):
    jax.config.update(_name, _value)  # type: ignore[no-untyped-call]
