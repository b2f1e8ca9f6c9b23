"""Listening to a radar: a recording that grows on screen."""
