"""Echo of a moving mesh at a sensor: velocity, visibility, amplitude."""
