"""Recordings made from nothing: a body, its gestures, their picture and their radar signal.

Everything made here is simulated and says so.
"""
