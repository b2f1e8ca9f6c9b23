"""Doppler maps on screen: synthesis, heatmaps, spectrum, difference, uncertainty."""
