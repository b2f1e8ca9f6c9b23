"""Comparison of moving meshes of one video."""
