"""The virtual bench, reached only by its name in a rig file."""

from workbench.emulator.bench import EmulatedBench, open_bench
from workbench.emulator.spec import EmulatorSpec

BLOCKS = {"emulator": EmulatorSpec}
"""Of a rig file, which nobody else reads; see `registry.blocks_of`."""

__all__ = ["BLOCKS", "EmulatedBench", "EmulatorSpec", "open_bench"]
