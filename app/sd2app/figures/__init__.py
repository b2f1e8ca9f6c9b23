"""Figures for papers: maps and strips of frames."""
