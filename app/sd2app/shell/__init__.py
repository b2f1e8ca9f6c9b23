"""The window itself: menus, status bar, keys, track stack, and the wiring of all features."""
