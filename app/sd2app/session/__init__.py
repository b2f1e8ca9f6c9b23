"""State that all features share: document, clock, sensor, display, undo, tasks. QtCore only."""
