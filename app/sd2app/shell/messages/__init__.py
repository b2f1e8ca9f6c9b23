"""Messages of the window: what is said, how it is shown, and what was said before."""
