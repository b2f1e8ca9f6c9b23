"""Listening to a radar: frames as they come, into a recording that grows."""
