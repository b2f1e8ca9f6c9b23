"""Comparison of the labels of two annotators."""
