"""Suggested spans, to be accepted or rejected."""
