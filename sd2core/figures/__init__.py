"""Figures for papers, drawn with matplotlib; no window."""
