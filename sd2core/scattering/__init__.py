"""What a sensor gets back from a moving mesh: velocity, visibility, amplitude."""
