"""Gesture classifiers: Doppler maps to a probability of every class in every frame."""
