"""State of the window: what is open, where the clock stands, what is shown."""
