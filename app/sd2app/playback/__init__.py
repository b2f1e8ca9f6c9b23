"""Transport bar, timeline and time wheel."""
