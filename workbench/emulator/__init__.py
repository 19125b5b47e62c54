"""Virtual bench, used only through its name in a rig file."""

from workbench.devices.drivers import BenchDriver
from workbench.emulator.bench import EmulatedBench, open_bench
from workbench.emulator.spec import EmulatorSpec

DRIVER = BenchDriver(open=open_bench, blocks={"emulator": EmulatorSpec}, virtual=True)
"""Entry point `emulated` in the group `workbench.benches`."""

__all__ = ["DRIVER", "EmulatedBench", "EmulatorSpec", "open_bench"]
