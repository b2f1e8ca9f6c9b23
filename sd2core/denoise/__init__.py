"""Synthetic Doppler to what a real radar would show: models, their files, their use."""
