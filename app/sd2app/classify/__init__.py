"""Gesture classifiers in the window: use, training, comparison."""
