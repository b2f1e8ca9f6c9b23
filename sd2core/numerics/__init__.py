"""Compiled kernels, choice of precision, rasterising, bounds of settings."""
