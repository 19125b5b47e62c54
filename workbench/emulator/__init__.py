"""The virtual bench, reached only by its name in a rig file."""

from workbench.emulator.bench import EmulatedBench, open_bench

__all__ = ["EmulatedBench", "open_bench"]
