"""Planned sensor placements, their cost, and the space that a body takes up."""
