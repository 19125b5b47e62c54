"""Pure maths of lens, rays and target, in JAX; no input or output.

Importing this room switches JAX to 64 bits: a micrometre at five metres needs 9 digits, 32 bits have 7.
"""

import jax

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]
