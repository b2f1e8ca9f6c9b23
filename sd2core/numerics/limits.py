"""Limits of what is computed, for those who check values and those who state bounds."""

FARTHEST_M = 1e9
"""Largest distance of a sensor from the camera: squares of ranges stay in single precision."""

MAX_BINS = 1 << 16
"""Most bins of a velocity axis; a radar's chirps per frame are a few hundred."""
