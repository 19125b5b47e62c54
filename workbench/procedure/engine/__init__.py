"""Engine that runs any step of a procedure file: placements, prompts, replay, limits."""
