"""Data sets to learn from: segments of many recordings, with labels, sensors and provenance.

``source`` says what is cut, ``options`` how; ``writing`` writes and ``reading`` opens.
"""
