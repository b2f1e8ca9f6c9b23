"""The video and what is drawn over it."""
