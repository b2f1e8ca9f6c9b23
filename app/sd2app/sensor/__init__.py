"""The virtual sensor's panel, and planned placements."""
