"""Commands, terminal output and prompts; the only package that interacts with a person."""

import gc

# Imports create 10^5 permanent objects; collecting among them takes a tenth of a short command's time.
gc.set_threshold(100_000)
