"""Judgement of what readers return: what is unlikely, why, and what would put it right.

Pure functions on arrays, a file per kind. They change nothing: readers put the findings, errors
that nobody raises, among their notes, and the window offers the cures. Limits are far from what a
body or a sensor does, so that what is sane is left without a word.
"""
