"""Labelled spans of time: what they are, how they are edited, and their files."""
