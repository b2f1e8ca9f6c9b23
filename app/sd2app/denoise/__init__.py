"""Denoised maps and the choice of the denoiser."""
