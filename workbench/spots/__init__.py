"""From a pair of frames to laser spots with their uncertainty."""
