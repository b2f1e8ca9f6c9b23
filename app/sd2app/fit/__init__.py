"""Fitting a body to a video in a background process."""
