"""Pure maths of lens, rays and target, in JAX; no input or output."""
