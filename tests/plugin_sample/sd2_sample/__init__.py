"""A package with one plug-in of each group."""
