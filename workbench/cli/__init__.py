"""Commands, terminal output and prompts; nothing else talks to a person."""

import gc

# Imports make 10^5 objects that stay: to look for garbage among them is a tenth of a short command.
gc.set_threshold(100_000)
