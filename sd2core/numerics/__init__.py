"""Compiled kernels, choice of precision, rasterising."""
