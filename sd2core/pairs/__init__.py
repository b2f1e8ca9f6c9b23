"""Pairs of synthetic and real maps to learn from, and their segments."""
