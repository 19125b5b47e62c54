"""Mutated inputs at every door of the workbench: no traceback, no exit code of 1, bounded time and memory."""
