"""Inertial sensors: what an accelerometer and a gyroscope on a moving body would measure."""
