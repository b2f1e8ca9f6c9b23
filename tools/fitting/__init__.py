"""Simulated clips of known motion, scores of fits on them, and the errors that fits make."""
