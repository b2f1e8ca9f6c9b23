"""Gesture classifiers in the window: use and training."""
