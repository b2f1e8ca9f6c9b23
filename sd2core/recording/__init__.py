"""Recordings on disk (``.sd2`` folders): document, files and how missing ones are found again."""
