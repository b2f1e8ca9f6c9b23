"""A radar by name."""

from dataclasses import replace

from sd2core import PAPER_RADAR

SD2_PLUGIN_API = 1

RADAR = replace(PAPER_RADAR, name="Tea radar", receivers=1)
