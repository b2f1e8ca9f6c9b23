"""Work beside the window: threads that report back to the Qt event loop."""
