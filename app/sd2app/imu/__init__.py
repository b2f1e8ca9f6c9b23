"""Inertial sensors on the body, and a real one's samples beside them."""
