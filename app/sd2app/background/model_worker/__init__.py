"""Process that holds torch, so that the window's process does not."""
