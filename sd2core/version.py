"""The program's version, where every room may read it."""

__version__ = "0.1.0"
"""Version of the program and the library.

Examples
--------
>>> import sd2core as sd2
>>> sd2.__version__.count(".")
2
"""
