"""Threads and background processes that report back to the Qt event loop."""
